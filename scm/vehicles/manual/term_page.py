"""The page of one physical effect, as Markdown, generated from the effect."""

from collections.abc import Iterator, Mapping

from scm.vehicles.car import car_names, load_car
from scm.vehicles.describe_effects import neutral_of, params_of
from scm.vehicles.manual.manoeuvres import MANOEUVRES
from scm.vehicles.manual.page_parts import equations, headings, parameter_table, story
from scm.vehicles.manual.picture import PLOTS
from scm.vehicles.manual.shown import DROPPED, Shown, shown_of
from scm.vehicles.physics_variables import VARIABLES
from scm.vehicles.term import Term, flat, reads


def term_page(term: Term) -> str:
    """Return one effect's page."""
    lines = [f"# {term.name}", "", term.about, "", "```", *equations(term.function), "```", ""]
    text = story(term.function)
    lines += [text, ""] if text else []
    lines += [f"![{term.name}: with and without]({term.name}.svg)", "", _caption(term), ""]
    lines += list(parameter_table(params_of(term), neutral_of(term)))
    lines += list(headings(term))
    lines += [f"**Acts on:** {_acts_on(term)}", "", f"**Reads:** {_reads(term)}", ""]
    lines += [f"**Cars that list it:** {_cars(term)}", "", *_example(term), ""]
    lines += [f"Code: `{term.module.replace('.', '/')}.py` · [all effects](README.md)"]
    return "\n".join(lines) + "\n"


def _caption(term: Term) -> str:
    shown = shown_of(term)
    sentences = [f"{shown.car}, {MANOEUVRES[shown.manoeuvre].about}"]
    own = {param.key for param in params_of(term)}
    both = {key: value for key, value in shown.both.items() if key not in own}
    sentences += [f"Both with {_numbers(both)}"] if both else []
    if PLOTS[shown.see].labels is None:
        sentences += [f"Blue: {_numbers(shown.numbers) or 'listed'}", f"Grey: {_other(shown)}"]
    return f"*{'. '.join(sentences)}.*"


def _numbers(numbers: Mapping[str, float]) -> str:
    return ", ".join(f"`{key} = {value:g}`" for key, value in numbers.items())


def _other(shown: Shown) -> str:
    if shown.other is DROPPED:
        return "the car without it"
    if shown.other is None:
        return "the same car with the effect at its neutral value"
    return _numbers(shown.other)


def _acts_on(term: Term) -> str:
    parts = []
    for part in flat([term]):
        variable = VARIABLES[part.target]
        verb = "adds to" if part.adds else "sets"
        where = "each wheel" if variable.per.value == "wheel" else "body"
        unit = "" if variable.unit == "1" else f" [{variable.unit}]"
        parts.append(f"{verb} `{part.target}`{unit} of the {where}: {variable.about}")
    return "; ".join(parts).replace("of the each", "of each") + "."


def _reads(term: Term) -> str:
    names = dict.fromkeys(
        name
        for part in flat([term])
        for function in (part.function, part.damping)
        if function
        for name in reads(function)
        if name in VARIABLES
    )
    return ", ".join(f"`{name}`" for name in names) or "only its own numbers"


def _cars(term: Term) -> str:
    users = [name for name in car_names() if term in load_car(name).terms]
    return ", ".join(users) or "none; list it to use it"


def _example(term: Term) -> Iterator[str]:
    yield "```toml"
    yield f'terms = [..., "{term.name}"]'
    section = ""
    for param in sorted(params_of(term), key=lambda param: param.key):
        key = param.key
        if key.partition(".")[0] != section:
            section = key.partition(".")[0]
            yield f"[{section}]"
        number = shown_of(term).numbers.get(key, param.default)
        yield f'{key.partition(".")[2]} = {{ value = {number:g}, source = "..." }}'
    yield "```"
