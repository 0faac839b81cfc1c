"""ASN.1 text written from pycrate's compiled types, so that another compiler can be given it.

Names, ranges, sizes, optional parts, defaults and extension marks are kept; references are written
out in place, and an open type becomes an octet string, which is coded alike.
"""


def module_of(name, pdu):
    """Return an ASN.1 module that defines one type."""
    return f"Made DEFINITIONS AUTOMATIC TAGS ::= BEGIN\n{name} ::= {type_of(pdu)}\nEND\n"


def type_of(of):
    """Return the notation of a type."""
    return _WRITERS[of.TYPE](of)


def _integer(of):
    return "INTEGER" + _limits(of._const_val, "")


def _limits(constraint, size):
    """Return a constraint on values, or on sizes; nothing for none."""
    if constraint is None:
        return ""
    parts = [_range(part) for part in constraint.root]
    if constraint.ext is not None:
        parts.append("...")
    inner = ", ".join([" | ".join(parts[: len(constraint.root)]), *parts[len(constraint.root) :]])
    return f" (SIZE ({inner}))" if size else f" ({inner})"


def _range(part):
    return str(part) if isinstance(part, int) else f"{part.lb}..{part.ub}"


def _enumerated(of):
    names = [f"{name}({of._cont[name]})" for name in of._root]
    return "ENUMERATED {" + ", ".join(names + _extension(of, lambda n: f"{n}({of._cont[n]})")) + "}"


def _extension(of, write):
    """Return the extension mark and what stands behind it, as a list of components."""
    return [] if of._ext is None else ["...", *(write(name) for name in of._ext)]


def _record(word):
    def write(of):
        def component(name):
            return f"{name} {type_of(of._cont[name])}{_presence(of._cont[name])}"

        parts = [component(name) for name in of._root] + _extension(of, component)
        return word + " {" + ",\n".join(parts) + "}"

    return write


def _presence(of):
    if of._def is not None:
        return f" DEFAULT {of._def}"
    return " OPTIONAL" if of._opt else ""


def _sequence_of(of):
    return f"SEQUENCE{_limits(of._const_sz, 'SIZE')} OF {type_of(of._cont)}"


def _sized(word):
    return lambda of: word + _limits(of._const_sz, "SIZE")


_WRITERS = {
    "INTEGER": _integer,
    "BOOLEAN": lambda of: "BOOLEAN",
    "ENUMERATED": _enumerated,
    "SEQUENCE": _record("SEQUENCE"),
    "CHOICE": _record("CHOICE"),
    "SEQUENCE OF": _sequence_of,
    "BIT STRING": _sized("BIT STRING"),
    "OCTET STRING": _sized("OCTET STRING"),
    "IA5String": _sized("IA5String"),
    "NumericString": _sized("NumericString"),
    "UTF8String": _sized("UTF8String"),
    "OPEN_TYPE": lambda of: "OCTET STRING",
}


def for_asn1tools(value):
    """Return a value of pycrate's as asn1tools wants it: its bit strings are bytes."""
    if isinstance(value, dict):
        return {name: for_asn1tools(part) for name, part in value.items()}
    if isinstance(value, list):
        return [for_asn1tools(part) for part in value]
    if isinstance(value, tuple) and isinstance(value[0], int):
        number, bits = value
        count = -(-bits // 8)
        return (number << (8 * count - bits)).to_bytes(count, "big"), bits
    if isinstance(value, tuple):
        return value[0], for_asn1tools(value[1])
    return value
