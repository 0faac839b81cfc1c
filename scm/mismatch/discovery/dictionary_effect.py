"""An effect of the dictionary: how much of what kind of push, against what it depends on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from scm.mismatch.discovery.general_effect import PREFIX
from scm.mismatch.effect_catalogue import Candidate, Parameter
from scm.mismatch.findings import Equation
from scm.vehicles.physics_variables import Per

Values = tuple[float, ...]
ToNumbers = Callable[[Values], Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Channel:
    """Where an effect acts.

    Attributes:
        word: As in `drive force against heading`.
        response: The general effect's number whose comb asks the same of each moment.
        parameters: How much; the first is the amount.
        numbers: Of the general effect, from the parameters' values.
        sentence: The sentence's beginning; braces take the parameters.
        formula: Of the effect; braces take the parameters, `{g}` the curve.
        text: Of the written effect, by the sum or variable it acts on; `g` is the curve.
    """

    word: str
    response: str
    equation: Equation
    parameters: tuple[Parameter, ...]
    numbers: ToNumbers
    sentence: str
    formula: str
    text: tuple["Written", ...]


@dataclass(frozen=True, slots=True)
class Written:
    """One function to write.

    Attributes:
        target: `adds force_x` or `sets steer_trimmed`.
        variables: It reads, beside the curve's.
        returns: The expression.
        about: What it returns.
        suffix: Of the function's name.
        per: Once a body or once a wheel.
        keeps: Where the variable starts that it sets from its own last value; None: it has no past.
    """

    target: str
    variables: tuple[str, ...]
    returns: str
    about: str
    suffix: str = ""
    per: Per = Per.BODY
    keeps: float | None = None


@dataclass(frozen=True, slots=True)
class Curve:
    """What an effect depends on, and how.

    Attributes:
        word: What it depends on, as reported.
        numbers: Of the general effect, from the parameters' values.
        text: Line that gives `g` from `variables` and the parameters.
        rare: What it must gain beyond others: it looks like something simpler.
        also: A variable that it reads and no car has.
    """

    name: str
    word: str
    parameters: tuple[Parameter, ...]
    numbers: ToNumbers
    sentence: str
    formula: str
    variables: tuple[str, ...]
    text: str
    equation: Equation | None = None
    rare: float = 0.0
    also: Written | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DictionaryEffect(Candidate):
    """An effect outside the catalogue, a candidate like those in it.

    Attributes:
        channel: Where it acts; `curve`: what it depends on. Their parameters follow each other.
    """

    channel: Channel
    curve: Curve

    @property
    def written(self) -> tuple[Written, ...]:
        """The functions that its file holds."""
        return (*self.channel.text, *filter(None, (self.curve.also,)))

    def numbers(self, values: Values) -> dict[str, float]:
        """Return the general effect's numbers, by key, at these values of the parameters."""
        n = len(self.channel.parameters)
        found = {**self.curve.numbers(values[n:]), **self.channel.numbers(values[:n])}
        return {PREFIX + name: value for name, value in found.items()}

    def formula(self, values: Values) -> str:
        """Return the formula with its numbers and units."""
        words = {
            parameter.name: f"{value:.3g}" + ("" if parameter.unit == "1" else f" {parameter.unit}")
            for parameter, value in zip(self.parameters, values, strict=True)
        }
        text = self.channel.formula.format(**words, g=self.curve.formula.format(**words))
        return text.replace("--", "").replace("- -", "+ ").replace("+ -", "- ")


def dictionary_effect(channel: Channel, curve: Curve) -> DictionaryEffect:
    """Return the effect that a channel and a curve make."""
    return DictionaryEffect(
        name=f"{channel.word} against {curve.word}",
        equation=curve.equation or channel.equation,
        depends_on=(curve.word,),
        parameters=(*channel.parameters, *curve.parameters),
        starts=(),
        sentence=f"{channel.sentence} {curve.sentence}.",
        rare=curve.rare,
        channel=channel,
        curve=curve,
    )
