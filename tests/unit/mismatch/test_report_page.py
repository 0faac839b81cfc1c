"""The page: complete, self-contained, and safe whatever names the files hold."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest
from msgspec import structs

from scm.data_quality.quality import DataProblem
from scm.mismatch.evidence import Evidence, RefittedParameter, Residual
from scm.mismatch.findings import Course, Effect, Equation, Estimate, Located, Verdict
from scm.mismatch.report.record import since_start
from scm.mismatch.report.sentences import verdict_sentence
from scm.mismatch.report.write import summary, write_report
from scm.vehicles.car import load_car
from tests.unit.mismatch import made_up_findings as made_up
from tests.unit.mismatch.made_up_findings import replace

ADDRESS = re.compile(r"""(?:https?:)?//[\w.-]+|url\(|@import|<link|<script|\bsrc\s*=""")
NAMESPACE = "http://www.w3.org/2000/svg"
NASTY = "<script>alert('x')</script>&\"quoted\""


def written(folder, case):
    write_report(*case, folder)
    return (folder / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page_of(tmp_path_factory):
    """The page of a case, written when it is first asked for."""
    pages = {}

    def page(name):
        if name not in pages:
            pages[name] = written(tmp_path_factory.mktemp(name), made_up.CASES[name]())
        return pages[name]

    return page


class Balanced(HTMLParser):
    """Complains where an element is not closed, or another one is."""

    VOID = ("meta", "br", "wbr", "img", "hr", "input")

    def __init__(self):
        super().__init__()
        self.open, self.names = [], []

    def handle_starttag(self, tag, attrs):
        self.names.append(tag)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.names.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.mark.parametrize("name", made_up.CASES)
def test_the_page_asks_nobody_for_anything(page_of, name):
    page = page_of(name)
    assert not ADDRESS.findall(page.replace(NAMESPACE, ""))


@pytest.mark.parametrize("name", made_up.CASES)
def test_every_element_of_the_page_is_closed(page_of, name):
    parser = Balanced()
    parser.feed(page_of(name))
    assert parser.open == []


@pytest.mark.parametrize("name", made_up.CASES)
def test_no_number_of_the_page_is_nan(page_of, name):
    page = page_of(name)
    assert not re.search(r"\b(nan|inf)\b", page, re.IGNORECASE)


def test_every_picture_of_the_page_is_a_file_with_its_colours(tmp_path):
    page = written(tmp_path, made_up.pair())
    files = sorted((tmp_path / "pictures").glob("*.svg"))
    assert page.count("<svg") == len(files)
    for file in files:
        picture = file.read_text(encoding="utf-8")
        assert "--before:" in picture
        assert picture.partition("</style>")[2].partition("</svg>")[0] in page


def test_a_second_report_leaves_no_picture_of_the_first(tmp_path):
    written(tmp_path, made_up.pair())
    written(tmp_path, made_up.bad_data())
    assert list((tmp_path / "pictures").glob("*.svg")) == []


def test_names_from_files_cannot_write_html(tmp_path):
    effect = replace(made_up.unlisted(), name=NASTY, text=NASTY, formula=NASTY, depends_on=(NASTY,))
    problem = DataProblem(channel=NASTY, name=NASTY, text=NASTY, record_instead=NASTY)
    found = made_up.diagnosis(verdict=Verdict.MISMATCH, effects=(effect,), data=(problem,))
    shown = made_up.evidence(
        vehicle=NASTY,
        recordings=(NASTY,),
        residuals=(replace(made_up.evidence().residuals[0], channel=NASTY, unit=NASTY),),
        curves=(replace(made_up.curve(NASTY), x_name=NASTY, y_name=NASTY, x_unit=NASTY),),
        refitted=(replace(made_up.refitted()[0], key=NASTY),),
        tried=(replace(made_up.tried()[0], name=NASTY),),
    )
    nigel = load_car("nigel")
    page = written(tmp_path, (found, shown, nigel, nigel))
    parser = Balanced()
    parser.feed(page)
    assert "script" not in parser.names
    assert "<script" not in page
    assert '"quoted"' not in page
    assert page.count("&lt;script&gt;") > 15


@pytest.mark.parametrize("name", made_up.CASES)
def test_evidence_that_is_empty_breaks_nothing(tmp_path, name):
    found, _, car, patched = made_up.CASES[name]()
    page = written(tmp_path, (found, Evidence(vehicle="x", recordings=()), car, patched))
    assert "<h1>" in page


def test_arrays_that_are_empty_or_unknown_break_nothing(tmp_path):
    nothing, unknown = np.zeros(0), np.full(40, np.nan)
    t = np.arange(40.0)
    sides = {"t_s": t, "x_m": unknown, "y_m": unknown, "before": unknown, "after": unknown}
    shown = made_up.evidence(
        residuals=(
            Residual(channel="a", unit="N", **dict.fromkeys(sides, nothing), std=nothing),
            Residual(channel="b", unit="N", **sides, std=unknown),
        ),
        curves=(replace(made_up.curve(), x=nothing, y=nothing, low=nothing, high=nothing),),
        free_runs=replace(
            made_up.free_runs(),
            measured={k: np.full((30, 61), np.nan) for k in ("x", "y", "yaw")},
        ),
    )
    nigel = load_car("nigel")
    page = written(tmp_path, (made_up.diagnosis(), shown, nigel, nigel))
    assert not re.search(r"\bnan\b", page)


def test_a_car_at_rest_has_a_map_too(tmp_path):
    still = made_up.evidence().residuals[0]
    shown = made_up.evidence(
        residuals=(replace(still, x_m=0 * still.x_m, y_m=0 * still.y_m),), free_runs=None
    )
    nigel = load_car("nigel")
    page = written(tmp_path, (made_up.diagnosis(), shown, nigel, nigel))
    assert ">1 cm</text>" in page


def test_an_hour_of_driving_stays_below_one_and_a_half_megabytes(tmp_path):
    names = ("drive force", "side force", "yaw moment", "wheel angle", "pose.x", "pose.y")
    shown = made_up.evidence(
        residuals=tuple(
            made_up.residual(name, "N", lambda t, x, y: np.sin(17 * t), i, seconds=3600.0)
            for i, name in enumerate(names)
        ),
        free_runs=made_up.free_runs(windows=1200),
    )
    nigel = load_car("nigel")
    assert len(written(tmp_path, (made_up.diagnosis(), shown, nigel, nigel))) < 1_500_000


VERDICTS = {
    "one_effect": "The simulator leaves out throttle lag.",
    "pair": "The simulator leaves out throttle lag and surface patch.",
    "none": "Nothing beyond noise: the simulator drives as the car does.",
    "cut_short": "Nothing beyond noise was found, but time ran out before everything was checked.",
    "undecided": "Motor gain or payload: this recording cannot tell which.",
    "unlisted_law": "leaves out drive force against heading, an effect outside its library.",
    "bad_data": "This recording does not allow a verdict on the car.",
}


@pytest.mark.parametrize(("name", "sentence"), VERDICTS.items())
def test_the_page_opens_with_the_verdict_in_plain_words(page_of, name, sentence):
    page = page_of(name)
    assert sentence in re.search(r"<h1>(.*?)</h1>", page)[1]


@pytest.mark.parametrize(("name", "sentence"), VERDICTS.items())
def test_the_command_line_says_the_same_verdict(tmp_path, name, sentence):
    assert sentence in summary(made_up.CASES[name]()[0], tmp_path)


def test_page_and_command_line_say_what_there_was_no_time_for(page_of, tmp_path):
    case = made_up.cut_short()
    page, lines = page_of("cut_short"), summary(case[0], tmp_path).splitlines()
    for question in case[0].unanswered:
        assert question.text.partition(":")[0] in page
        assert f"  not answered: {question.text}" in lines
    assert "What was checked" not in page
    assert "Time ran out" in page
    assert "Time ran out" not in page_of("none")


@pytest.mark.parametrize(("share", "said"), [(0.31, True), (1.7, False), (None, False)])
def test_a_search_that_got_little_of_the_processor_says_so(tmp_path, share, said):
    found, *others = made_up.cut_short()
    case = replace(found, processor_share=share), *others
    words = "This process got 31"
    assert (words in written(tmp_path, case)) is said
    assert (words in summary(case[0], tmp_path)) is said


def test_a_difference_that_was_not_explained_in_time_may_have_a_cause():
    found = replace(made_up.cut_short()[0], verdict=Verdict.MISMATCH)
    assert verdict_sentence(found) == (
        "Simulator and recording differ, and time ran out before a cause was found."
    )


def test_a_fault_of_measuring_is_not_blamed_on_the_simulator(tmp_path):
    effect = Effect(name="gyro_bias", is_known=True, equation=Equation.SENSOR, depends_on=(),
                    parameters={"bias_rad_s": made_up.estimate(0.02, "rad/s")}, probability=0.99,
                    text="The gyro turns at rest.")  # fmt: skip
    found = made_up.diagnosis(verdict=Verdict.MISMATCH, effects=(effect,))
    nigel = load_car("nigel")
    page = written(tmp_path, (found, made_up.evidence(), nigel, nigel))
    assert "<h1>The measurements are off, not the car: gyro bias.</h1>" in page


def test_problems_that_stop_the_verdict_stand_on_the_first_screen(page_of):
    first, _, _ = page_of("bad_data").partition("<nav>")
    assert "The recording holds no throttle command." in first
    assert "Keep the tag in the camera" in first


@pytest.mark.parametrize(
    ("given", "found", "is_shown"),
    [(0.5, 1.0, True), (0.5, 0.9, False), (1.0, 1.0, False)],
    ids=["moved to its bound", "moved to near it", "was there before"],
)
def test_a_number_at_its_bound_stands_on_the_first_screen(tmp_path, given, found, is_shown):
    diagnosis, evidence, *cars = made_up.none()
    lock = RefittedParameter(
        key="drive.axle_lock", given=given, given_std=0.5, bounds=(0.0, 1.0),
        found=Estimate(value=found, low=0.8, high=1.0, unit="1"),
    )  # fmt: skip
    page = written(tmp_path, (diagnosis, replace(evidence, refitted=(lock,)), *cars))
    said = "moved from 0.5 to 1, the most that is physically possible"
    assert (said in page[: page.index("<section")]) == is_shown


def test_what_to_do_stands_on_the_first_screen(page_of):
    first, _, _ = page_of("one_effect").partition("<nav>")
    assert "Look for a soft start" in first


def test_the_range_in_which_an_effect_was_seen_stands_on_the_first_screen(page_of):
    first, _, _ = page_of("unlisted_law").partition("<nav>")
    assert "Seen at heading \N{MINUS SIGN}69° to 138°." in first
    assert "Seen at" not in page_of("one_effect")


def test_the_first_screen_says_how_much_better_it_got(page_of):
    first, _, _ = page_of("one_effect").partition("<nav>")
    assert "after 3&nbsp;s of driving by the recorded commands alone" in first
    assert "the simulator is 36.1&nbsp;cm off" in first
    assert "with what was found and its own numbers refitted, 4.2&nbsp;cm." in first


def test_an_undecided_page_says_what_to_drive(page_of):
    first, _, _ = page_of("undecided").partition("<nav>")
    assert "Put a known mass of 0.5&nbsp;kg on the car" in first


def test_windows_that_the_fit_did_not_see_come_first(tmp_path):
    found, shown, car, patched = made_up.one_effect()
    page = written(tmp_path, (found, shown, car, patched))
    starts = {
        f"{start:.1f}"
        for start, part in zip(shown.free_runs.start_s, shown.free_runs.part, strict=True)
        if part == "confirm"
    }
    drawn = re.findall(r">from ([\d.]+) s</text>", page)
    assert len(drawn) == len(shown.free_runs.part)
    assert set(drawn[: len(starts)]) == starts


def test_a_recording_of_another_car_is_said_to_be_one(tmp_path):
    problem = DataProblem(channel="*", name="other_car", text="Wheels roll 1.6 times as far.",
                          record_instead="Nothing: give the file of the car.")  # fmt: skip
    nigel = load_car("nigel")
    page = written(tmp_path, (made_up.diagnosis(data=(problem,)), made_up.evidence(), nigel, nigel))
    assert "another car was driven.</h1>" in page


def test_what_is_wrong_with_several_channels_alike_is_one_card(tmp_path):
    problems = tuple(
        DataProblem(channel=channel, name="too_short", text="Holds 3 s.", record_instead="More.")
        for channel in ("pose.*", "imu.*")
    )
    nigel = load_car("nigel")
    case = (made_up.diagnosis(data=problems), made_up.evidence(), nigel, nigel)
    first, _, _ = written(tmp_path, case).partition("<nav>")
    assert re.findall(r'card data".*?<h2>(.*?)</h2>', first) == ["Too short: poses and IMU"]


def test_sensors_of_one_table_are_named_as_a_person_names_them(tmp_path):
    said = "Rows come every 20 ms as a rule."
    problems = tuple(
        DataProblem(channel=channel, name="jitter", text=said, record_instead="Stamp it there.")
        for channel in ("pose.*", "encoder.*, imu.*")
    )
    nigel = load_car("nigel")
    case = (made_up.diagnosis(data=problems), made_up.evidence(), nigel, nigel)
    first, _, _ = written(tmp_path, case).partition("<nav>")
    assert "<h2>Jitter: poses, encoders and IMU</h2>" in first
    printed = summary(case[0], tmp_path)
    assert f"recording, poses, encoders and IMU: {said}\n    record instead" in printed
    assert printed.count(said) == 1


def test_the_command_line_holds_what_was_found_against_refitted_numbers_too(tmp_path):
    found, *_ = made_up.one_effect()
    (line,) = [one for one in summary(found, tmp_path, 0.123).splitlines() if "unseen" in one]
    alone = "(with its own numbers refitted alone: 12.3 cm; "
    assert line.endswith(f"{alone}a kinematic bicycle with 8 numbers: 9.3 cm)")
    assert "refitted" not in summary(found, tmp_path)


def test_a_bars_number_stands_clear_of_the_mark_of_noise(tmp_path):
    found, shown, car, patched = made_up.one_effect()
    for after in (0.004, 0.0051, 0.0062, 0.035):
        barely = replace(found, fit=made_up.fit(before=0.04, after=after))
        write_report(barely, shown, car, patched, tmp_path)
        svg = (tmp_path / "pictures" / "better.svg").read_text()
        mark = float(re.search(r'd="M([\d.]+) ', svg).group(1))
        texts = re.findall(r'<text x="([\d.]+)"[^>]*class="strong"[^>]*>([^<]*)<', svg)
        assert len(texts) == 3
        for x, words in texts:
            assert not float(x) - 4.0 < mark < float(x) + 7.0 * len(words)


def test_what_is_wrong_with_several_recordings_alike_is_one_card(tmp_path):
    problems = tuple(
        DataProblem(channel="speed", name="missing", text=f"{name}: Not there.", record_instead="x")
        for name in ("one", "two")
    )
    nigel = load_car("nigel")
    shown = made_up.evidence(recordings=("one", "two"))
    first, _, _ = written(
        tmp_path, (made_up.diagnosis(data=problems), shown, nigel, nigel)
    ).partition("<nav>")
    assert first.count("Not there.") == 1
    assert "one and two" in first


def test_ten_effects_are_counted_where_no_sentence_holds_their_names(tmp_path):
    car = [replace(made_up.lag(), name=f"effect_{i}") for i in range(7)]
    measuring = [replace(made_up.lag(), name=f"fault_{i}", equation=Equation.SENSOR)
                 for i in range(3)]  # fmt: skip
    found = made_up.diagnosis(verdict=Verdict.MISMATCH, effects=(*car, *measuring))
    nigel = load_car("nigel")
    page = written(tmp_path, (found, made_up.evidence(), nigel, nigel))
    sentence = "The simulator leaves out seven effects, and the measurements have three faults."
    assert f"<h1>{sentence}</h1>" in page
    assert "Effect 0, effect 1," in page


def test_a_clock_that_counts_from_1970_is_shown_from_the_start(tmp_path):
    shown, start_s = made_up.evidence(), 1_700_000_000.0
    problem = DataProblem(channel="pose.*", name="gap", text="Nothing comes.",
                          when_s=((start_s + 31.0, start_s + 34.0),))  # fmt: skip
    far = replace(
        shown,
        residuals=tuple(replace(r, t_s=r.t_s + start_s) for r in shown.residuals),
        free_runs=replace(shown.free_runs, start_s=shown.free_runs.start_s + start_s),
    )
    nigel = load_car("nigel")
    page = written(tmp_path, (made_up.diagnosis(data=(problem,)), far, nigel, nigel))
    assert "at 31.0 to 34.0&nbsp;s" in page
    assert re.findall(r"\d{9,}", page) == ["1700000000"]
    assert "time since 1700000000 s of the recording" in page


def test_a_change_on_a_clock_from_1970_is_since_the_recordings_start(tmp_path):
    found, evidence, *cars = made_up.CASES["one_effect"]()
    start_s = 1_700_000_000.0
    since = Estimate(value=start_s + 42.0, low=start_s + 41.0, high=start_s + 43.0, unit="s")
    late = structs.replace(found.effects[0], course=Course.STEP, since_s=since)
    found = structs.replace(found, effects=(late, *found.effects[1:]))
    dated = replace(
        evidence,
        residuals=tuple(replace(r, t_s=r.t_s + start_s) for r in evidence.residuals),
        free_runs=replace(evidence.free_runs, start_s=evidence.free_runs.start_s + start_s),
    )
    first = since_start(found, dated).effects[0].since_s
    assert (first.low, first.high) == (41.0, 43.0)
    assert since_start(found, evidence) is found
    write_report(found, dated, *cars, tmp_path)
    assert "since 42.0 s (41.0 to 43.0 s)" in (tmp_path / "car.toml").read_text(encoding="utf-8")


def test_what_came_and_went_is_shown_with_both_moments_and_its_own_car_file(tmp_path):
    found, evidence, *cars = made_up.CASES["one_effect"]()
    since, until = (Estimate(value=t, low=t - 0.5, high=t + 0.5, unit="s") for t in (12.0, 20.0))
    gone = structs.replace(
        found.effects[0], course=Course.INTERMITTENT, since_s=since, until_s=until
    )
    found = structs.replace(found, effects=(gone,))
    write_report(found, evidence, *cars, tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "From 12.0&nbsp;s (11.5 to 12.5&nbsp;s) to 20.0&nbsp;s (19.5 to 20.5&nbsp;s)" in page
    assert "during.toml" in page
    assert "before.toml" not in page
    line = (tmp_path / "pictures" / "time_line.svg").read_text(encoding="utf-8")
    assert line.count('class="since-area"') == 4  # of two panels
    dated = replace(evidence, residuals=tuple(
        replace(r, t_s=r.t_s + 1_700_000_000.0) for r in evidence.residuals
    ), free_runs=None)  # fmt: skip
    late = structs.replace(until, value=1_700_000_020.0)
    shown = since_start(
        structs.replace(found, effects=(structs.replace(gone, until_s=late),)), dated
    )
    assert shown.effects[0].until_s.value == 20.0


def test_the_strip_says_what_served_what_on_the_axis_of_one_recording_or_several(tmp_path):
    found, shown, car, patched = made_up.one_effect()
    line = tmp_path / "pictures" / "time_line.svg"
    for names in (("one",), ("one", "two")):
        written(tmp_path, (found, replace(shown, recordings=names), car, patched))
        drawn = line.read_text(encoding="utf-8").partition("</style>")[2]
        assert "only confirms" in drawn
        assert ("one recording after another" in drawn) is (len(names) > 1)


def test_an_effect_is_located_where_its_own_error_lies(tmp_path):
    effects = tuple(
        replace(made_up.lag(), name=name, equation=Equation.SENSOR, depends_on=(driver,))
        for name, driver in (("pose_heading", "constant"), ("clock_offset", "speed"))
    )
    located = tuple(
        Located(equation=Equation.SENSOR, channels=("pose.x",), depends_on=(driver,), when_s=None,
                where=None, share_of_error=share)
        for driver, share in (("constant", 0.6), ("speed", 0.25))
    )  # fmt: skip
    found = made_up.diagnosis(verdict=Verdict.MISMATCH, effects=effects, located=located)
    nigel = load_car("nigel")
    first, _, _ = written(tmp_path, (found, made_up.evidence(), nigel, nigel)).partition("<nav>")
    heading, clock = first.split("<article")[1:3]
    assert "60&nbsp;% of the error" in heading
    assert "25&nbsp;% of the error" not in heading
    assert "Depends on speed. It makes 25&nbsp;% of the error." in clock


def test_a_formula_is_drawn_over_what_was_measured_without_it(tmp_path):
    bins, law = made_up.curve("x against speed"), made_up.curve("x against speed")
    found, _, car, patched = made_up.one_effect()
    page = written(tmp_path, (found, made_up.evidence(curves=(bins, law)), car, patched))
    assert len(list((tmp_path / "pictures").glob("curve_*.svg"))) == 1
    assert "the line is the formula" in page


def test_a_difference_without_a_name_says_what_to_do(tmp_path):
    nigel = load_car("nigel")
    case = (made_up.diagnosis(verdict=Verdict.MISMATCH), made_up.evidence(), nigel, nigel)
    first, _, _ = written(tmp_path, case).partition("<nav>")
    assert "no cause could be named.</h1>" in first
    assert "Weigh and measure the car" in first


def test_small_things_noticed_in_the_recording_take_one_line_and_no_card(tmp_path):
    small = [
        DataProblem(channel=f"imu.{i}", name="coarse", text=f"Steps of {i}.") for i in range(9)
    ]
    nigel = load_car("nigel")
    case = (made_up.diagnosis(data=tuple(small)), made_up.evidence(), nigel, nigel)
    first, _, below = written(tmp_path, case).partition("<nav>")
    assert "card data" not in first
    assert "coarse of imu.0" in first
    assert "Steps of 8." in below


def test_noise_is_grey_on_the_map_and_a_force_is_not(tmp_path):
    nigel = load_car("nigel")
    strong = {}
    for name, force in (("calm", lambda t, x, y: 0.0 * t), ("wind", lambda t, x, y: 0.5 + 0.0 * t)):
        shown = made_up.evidence(residuals=(made_up.residual("drive force", "N", force),))
        written(tmp_path / name, (made_up.diagnosis(), shown, nigel, nigel))
        way = (tmp_path / name / "pictures/floor_1.svg").read_text().partition("</style>")[2]
        way = way.partition('class="side-after"')[0]
        lengths = {
            kind: sum(len(data) for data in re.findall(rf'd="([^"]*)" class="d{kind}"', way))
            for kind in range(9)
        }
        strong[name] = 1.0 - lengths[4] / sum(lengths.values())
    assert strong["calm"] < 0.2
    assert strong["wind"] > 0.8


def test_what_was_found_is_held_against_the_car_with_its_own_numbers_refitted(tmp_path):
    found, shown, car, patched = made_up.one_effect()
    page = written(tmp_path, (found, replace(shown, retuned_m=0.213), car, patched))
    first = page[: page.index("<nav")]
    said = "with its own numbers refitted alone, 21.3 cm; with what was found as well, 4.2 cm."
    assert said in first.replace("&nbsp;", " ")
    assert "its own numbers refitted, no new physics" in first
    assert first.count('class="bar-') == 4


def test_a_plain_model_stands_beside_the_car_found_in_words_bars_and_table(tmp_path):
    found, *others = made_up.one_effect()
    fit = made_up.fit(retuned=made_up.errors(0.213, 0.1065))
    page = written(tmp_path, (replace(found, fit=fit), *others)).replace("&nbsp;", " ")
    first, below = page[: page.index("<nav")], page[page.index("<nav") :]
    assert "A kinematic bicycle with 8 numbers is 9.3 cm off." in first
    assert first.count("kinematic bicycle with 8 numbers") == 2
    table = below[below.index("noise alone") : below.index("</table>", below.index("noise alone"))]
    rows = [re.sub(r"<[^>]*>", "|", row) for row in table.split("</tr>")]
    confirmed = next(i for i, row in enumerate(rows) if "only confirms: 8 windows" in row)
    columns = re.sub(r"\|+", "|", rows[confirmed + 1]).strip("|").split("|")
    assert columns == ["position", "36.1 cm", "4.2 cm", "0.60 cm", "21.3 cm", "9.3 cm"]
    assert "wheel angle at full steering 29.8°" in below


def test_a_report_without_a_plain_model_says_nothing_of_one(tmp_path):
    found, *others = made_up.one_effect()
    page = written(tmp_path, (replace(found, fit=made_up.fit(witness=None)), *others))
    assert "bicycle" not in page
