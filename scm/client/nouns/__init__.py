"""One file a noun of the interface.

Written by docs/make/client.py: do not change it here.
"""
