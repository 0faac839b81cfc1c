"""What the interface answers.

Written by docs/make/client.py: do not change it here.
"""
