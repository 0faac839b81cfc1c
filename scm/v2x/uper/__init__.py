"""Standard UPER of ETSI messages, as used on real roads: optional extra `scm[v2x]`.

`codec.py` encodes and decodes; one file per message maps its record to the ASN.1 value. pycrate
compiled the ASN.1; it has no CPM (TS 103 324), so a CPM stays JSON here.
"""
