"""Records that cross a border: of map files, messages, REST and the client. Imports msgspec alone.

One file a noun. Each record is written once; messages, routes, the store and the client import it.
To add one: write it in the file of its noun, with unit and bounds in each field's `Meta`.
"""
