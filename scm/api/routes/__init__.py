"""One file per noun of the web interface; its router names as arguments the services that it needs.

The application finds each file by its name and mounts it below `/api/v1`, or its own `PREFIX`.
"""
