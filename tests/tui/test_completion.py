"""Completion, ticks, and the texts of numbers: what an editor does to a text, without a terminal."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import cells, domains

from contextdb.cells.conditions import Condition
from contextdb.cells.domains import ANGLE, BOOL, INT, NUMBER, TAGS, TEXT, Domain
from contextdb.cells.grammar import parse_cell
from contextdb.cells.sets import Cell, TagSet, ValueSet
from contextdb.errors import Fault
from tui.model.chooser import Chooser
from tui.model.completion import Vocabulary, alone, take_apart, tick_of, toggled, vocabulary
from tui.model.meaning import meaning, mend_of
from tui.model.number_forms import nudged, other_form

CHART = Domain("enum", ("CB", "FS", "SS", "LB", "Half Back"))
MOVES = Domain("tags", ("InAir", "Move.Run", "Stunned", "Move.Walk.Slow"))
SPEED = Domain("number", None, 0.0, 7.0)


def chooser(domain: Domain, known: tuple[str, ...] = (), is_fact: bool = False) -> Chooser:
    return Chooser(Condition("c", domain), domain.kind, known, is_fact)


def offered(domain: Domain, text: str, caret: int | None = None, **more: object) -> list[str | None]:
    return list(chooser(domain, **more).offer(text, len(text) if caret is None else caret, False).rows)


def picked(domain: Domain, text: str, row: str | None, caret: int | None = None, **more: object) -> tuple[str, int]:
    one, at = chooser(domain, **more), len(text) if caret is None else caret
    return one.pick(text, row, one.offer(text, at, False).word)


# ---- the word at the caret


def test_the_word_at_the_caret_is_completed_and_the_others_stay():
    assert offered(CHART, "CB F") == ["FS", "Half Back"]
    assert picked(CHART, "CB F", "FS") == ("CB FS", 5)
    assert picked(CHART, "F SS ~2", "FS", caret=1) == ("FS SS ~2", 2)


def test_values_already_there_are_left_out():
    assert offered(CHART, "CB SS ") == ["FS", "LB", "Half Back"]
    assert offered(CHART, "FS S") == ["SS"]


def test_a_value_that_needs_quotes_gets_them():
    assert picked(CHART, "CB Ha", "Half Back") == ('CB "Half Back"', 14)


def test_a_word_in_quotes_is_completed_before_the_quote_is_closed():
    assert offered(CHART, 'CB "half b') == ["Half Back"]
    assert picked(CHART, 'CB "half b', "Half Back") == ('CB "Half Back"', 14)


def test_after_not_values_are_offered_as_before():
    assert offered(CHART, "not C") == ["CB", "Half Back"]
    assert picked(CHART, "not C", "CB") == ("not CB", 6)


def test_nothing_is_completed_in_the_penalty():
    one = chooser(CHART)
    assert one.offer("CB ~2", 5, False).word is None


def test_a_tag_keeps_its_sign_and_gets_one_where_it_has_none():
    assert picked(MOVES, "+InAir -st", "Stunned") == ("+InAir -Stunned", 15)
    assert picked(MOVES, "st", "Stunned") == ("+Stunned", 8)


def test_a_sign_alone_is_offered_every_tag_not_yet_named():
    assert offered(MOVES, "+InAir -") == ["Move", "Move.Run", "Move.Walk", "Move.Walk.Slow", "Stunned"]


def test_tags_are_offered_with_those_that_they_stand_under():
    assert vocabulary(MOVES).values == ("InAir", "Move", "Move.Run", "Move.Walk", "Move.Walk.Slow", "Stunned")


def test_what_begins_so_comes_before_what_has_a_part_that_does_and_what_only_contains_it():
    names = Vocabulary(("Top_Going", "Ongoing", "Going_Up"))
    assert names.matching("go") == ["Going_Up", "Top_Going", "Ongoing"]


def test_values_that_are_not_declared_are_those_that_the_cells_of_the_column_name():
    assert vocabulary(TEXT, ['left "far left"', "not up ~2", "Any", '"broken']).values == ("far left", "left", "up")
    assert vocabulary(TAGS, ["+Move.Run -InAir"]).values == ("InAir", "Move", "Move.Run")


def test_an_asset_is_completed_as_a_whole():
    one = Chooser(None, "asset", ("walk fast", "walk", ""), False)
    assert one.offer("wa", 2, False).rows == ["walk fast", "walk"]
    assert one.offer("walk", 4, False).rows == ["walk fast"]
    assert one.offer("", 0, False).rows == ()
    assert one.pick("wa", "walk fast", None) == ("walk fast", 9)


def test_a_bool_offers_its_three_cells_and_a_fact_none_at_all_as_the_third():
    assert offered(BOOL, "t") == ["True", "False", None]
    assert picked(BOOL, "t", None) == ("Any", 3)
    assert picked(BOOL, "t", None, is_fact=True) == ("", 0)


def test_a_plain_fact_with_a_space_is_one_value():
    one = chooser(CHART, is_fact=True)
    assert one.ticks("Half Back")("Half Back") == "on"
    assert one.toggle("Half Back", "CB") == '"Half Back" CB'


def test_a_value_that_begins_longer_ones_is_offered_them():
    domain = Domain("enum", ("Top", "Top_Left", "Down"))
    assert offered(domain, "Top") == ["Top_Left"]
    assert picked(domain, "Top", "Top_Left") == ("Top_Left", 8)


def test_what_is_typed_into_the_list_begins_a_word_before_the_penalty():
    one = chooser(CHART)
    assert one.typed("CB ~2", "L") == ("CB L ~2", 4)
    assert one.typed("CB", "L") == ("CB L", 4)
    assert one.typed("Any", "L") == ("L", 1)
    assert one.typed("~2", "L") == ("L ~2", 1)


# ---- ticks


def test_ticks_add_and_take_away_and_leave_not_and_the_penalty():
    one = chooser(CHART)
    assert one.toggle("CB FS ~2.5", "SS") == "CB FS SS ~2.5"
    assert one.toggle("CB FS SS", "FS") == "CB SS"
    assert one.toggle("Any", "CB") == "CB"
    assert one.toggle("CB", "CB") == "Any"
    assert one.toggle("not CB", "FS") == "not CB FS"
    assert one.toggle("not CB", "CB") == "Any"
    assert chooser(CHART, is_fact=True).toggle("CB", "CB") == ""


def test_what_is_not_named_by_a_cell_with_not_is_ticked():
    assert list(map(chooser(CHART).ticks("not CB FS"), CHART.values or ())) == ["off", "off", "on", "on", "on"]


def test_a_tag_goes_round_from_not_named_to_has_to_has_not():
    one = chooser(MOVES)
    assert one.toggle("+InAir", "Stunned") == "+InAir +Stunned"
    assert one.toggle("+InAir +Stunned", "Stunned") == "+InAir -Stunned"
    assert one.toggle("+InAir -Stunned", "Stunned") == "+InAir"
    assert one.toggle("+InAir", "InAir", "-") == "-InAir"


def test_a_fact_of_plain_tags_stays_plain():
    one = chooser(MOVES, is_fact=True)
    assert one.toggle("InAir", "Stunned") == "InAir Stunned"
    assert one.toggle("InAir Stunned", "InAir") == "Stunned"
    assert one.toggle("+InAir", "Stunned") == "+InAir +Stunned"


@given(st.data(), domains(("enum", "text")))
def test_a_tick_changes_whether_its_value_is_accepted_and_no_other(data, domain):
    text = data.draw(cells(domain))
    cell = parse_cell(text, domain)
    value = data.draw(st.sampled_from(domain.values or ("left", "Half Back", "not")))
    found = take_apart(text, False)
    after = parse_cell(toggled(found, value, False), domain)
    assert after.penalty == cell.penalty
    if not found.words:
        assert after == Cell(ValueSet(frozenset([value])), cell.penalty)
        return
    assert tick_of(found, value) == ("on" if cell.holds(value) else "off")
    if not after.is_any:
        assert after.holds(value) is not cell.holds(value)
    others = [v for v in domain.values or ("up", "x y") if v != value]
    assert after.is_any or all(after.holds(v) is cell.holds(v) for v in others)


@given(st.data(), domains(("tags",)))
def test_a_tick_of_a_tag_changes_what_is_said_of_it_and_of_no_other(data, domain):
    text = data.draw(cells(domain))
    cell = parse_cell(text, domain)
    assume(isinstance(cell.accepts, TagSet) and not cell.accepts.needs & cell.accepts.bans)
    value = data.draw(st.sampled_from(sorted(vocabulary(domain, [text, "+InAir"]).values)))
    found = take_apart(text, True)
    assume(found.words)
    after = parse_cell(toggled(found, value, True), domain)
    accepts = after.accepts if isinstance(after.accepts, TagSet) else TagSet(frozenset())
    said = tick_of(found, value)
    assert (value in accepts.needs, value in accepts.bans) == {"off": (True, False), "+": (False, True), "-": (False, False)}[said]
    assert accepts.needs - {value} == cell.accepts.needs - {value}
    assert accepts.bans - {value} == cell.accepts.bans - {value}


@given(st.data(), domains(("enum", "text", "tags")))
def test_every_word_of_a_text_is_found_as_the_grammar_reads_it(data, domain):
    text = data.draw(cells(domain))
    accepts, found = parse_cell(text, domain).accepts, take_apart(text, domain.kind == "tags")
    if isinstance(accepts, TagSet):
        assert {w.name for w in found.words if w.sign == "+"} == accepts.needs
        assert {w.name for w in found.words if w.sign == "-"} == accepts.bans
    elif isinstance(accepts, ValueSet) and found.words:
        assert {w.name for w in found.words} == accepts.values or found.n_negations


@given(st.text('ab "~+-not.\n', max_size=12), st.integers(0, 12), st.booleans())
def test_any_text_can_be_taken_apart_and_completed(text, caret, has_signs):
    one = chooser(MOVES if has_signs else CHART)
    offer = one.offer(text, min(caret, len(text)), False)
    for row in list(offer.rows)[:2]:
        changed, at = one.pick(text, row, offer.word)
        assert 0 <= at <= len(changed)
    assert alone(take_apart(text, has_signs), "CB").startswith("CB")


# ---- numbers


@pytest.mark.parametrize(
    ("text", "domain", "other"),
    [
        ("10..30", NUMBER, "20, 10"),
        ("20, 10", NUMBER, "10..30"),
        ("2 ± 1 ~2.5", NUMBER, "1..3 ~2.5"),
        ("0..5 | 10..15", NUMBER, "2.5, 2.5 | 12.5, 2.5"),
        ("170..-170", ANGLE, "180, 10"),
        ("180, 10", ANGLE, "170..-170"),
        ("(10..30)", INT, "20, 9"),
    ],
)
def test_bounds_and_centre_with_tolerance_are_rewritten_into_each_other(text, domain, other):
    assert other_form(text, domain) == other


@pytest.mark.parametrize("text", ["0.1..0.3", "(10..30)", "10..", "not 5", "Any", "10.01..29.99", "nonsense", "5..3"])
def test_a_form_that_would_not_be_equal_to_the_last_bit_is_not_offered(text):
    assert other_form(text, NUMBER) is None


@given(st.data(), domains(("int", "number", "angle")))
def test_the_other_form_means_the_same(data, domain):
    text = data.draw(cells(domain))
    other = other_form(text, domain)
    assume(other is not None)
    assert parse_cell(other, domain) == parse_cell(text, domain)


@pytest.mark.parametrize(
    ("text", "caret", "steps", "changed"),
    [
        ("0.3..1.1", 1, 1, "0.4..1.1"),
        ("0.3..1.1", 8, -1, "0.3..1"),
        ("0.9", 3, 1, "1"),
        ("2.50, 1", 4, 10, "3.50, 1"),
        ("2 +-1", 5, 1, "2 +-1.1"),
        ("2 ~1", 4, 1, "2 ~1.1"),
        ("(1..2]", 6, 1, "(1..2.1]"),
        ("7", 1, 1, "7"),
    ],
)
def test_the_number_at_the_caret_is_moved_by_a_step_and_stays_as_it_is_written(text, caret, steps, changed):
    assert nudged(text, caret, SPEED, steps) is not None
    assert nudged(text, caret, SPEED, steps)[0] == changed


def test_an_angle_goes_on_through_half_a_turn():
    assert nudged("170..180", 8, ANGLE, 1) == ("170..-179", 9)
    assert nudged("-180, 5", 4, ANGLE, -1) == ("179, 5", 3)


def test_whole_numbers_move_by_one_and_others_by_a_power_of_ten_that_fits_the_domain():
    assert nudged("3", 1, INT, 1) == ("4", 1)
    assert nudged("3", 1, Domain("number", None, 0.0, 1000.0), 1) == ("13", 2)


@pytest.mark.parametrize("text", ["Any", "", "not a number", "inf"])
def test_what_cannot_be_moved_is_left_alone(text):
    assert nudged(text, len(text), SPEED, -1) is None


@given(st.data(), domains(("int", "number", "angle")), st.integers(-10, 10))
def test_what_is_moved_still_reads(data, domain, steps):
    text = data.draw(cells(domain))
    moved = nudged(text, data.draw(st.integers(0, len(text))), domain, steps)
    if moved is not None:
        assert parse_cell(moved[0], domain).is_empty <= parse_cell(text, domain).is_empty
        assert 0 <= moved[1] <= len(moved[0])


# ---- what a text means


@pytest.mark.parametrize(
    ("text", "domain", "said"),
    [
        ("CB FS", CHART, "2 of 5 declared values"),
        ("not CB ~2", CHART, "4 of 5 declared values; others cost 2 more"),
        ("not Any", CHART, "no value: the row never matches"),
        ("a b", TEXT, "2 values"),
        ("not a", TEXT, "every value but 1"),
        ("T", BOOL, "only True"),
        ("", BOOL, "every value"),
        ("+InAir -Stunned", MOVES, "has InAir, has not Stunned"),
        ("not +InAir", MOVES, "anything but: has InAir"),
        ("1..2", SPEED, "1 to 2 m/s, ends included"),
    ],
)
def test_what_a_cell_means(text, domain, said):
    assert meaning(text, Condition("c", domain, "m/s" if domain is SPEED else "")).words == said


@pytest.mark.parametrize(
    ("text", "domain", "said"),
    [
        ("", BOOL, "not given"),
        ("t", BOOL, "is True"),
        ("Half Back", CHART, "is Half Back"),
        ("CB FS", CHART, "may be 2 of 5 declared values"),
        ("InAir Stunned", MOVES, "has InAir Stunned"),
        ("+InAir -Stunned", MOVES, "has InAir, has not Stunned; it may have others"),
        ("3", SPEED, "exactly 3"),
        ("1..2", SPEED, "may be 1 to 2, ends included"),
    ],
)
def test_what_a_fact_means(text, domain, said):
    assert meaning(text, Condition("c", domain), is_fact=True).words == said


@given(st.data(), domains(), st.booleans())
def test_every_cell_has_a_meaning(data, domain, is_fact):
    text = data.draw(cells(domain))
    found = meaning(text, Condition("c", domain), is_fact)
    assert bool(found.words) is (found.fault is None)


def test_a_mend_is_the_text_itself_even_where_its_message_is_shortened():
    many = " ".join(f"Half_Back_{n}" for n in range(20))
    domain = Domain("enum", tuple(many.split()))

    def check(text: str) -> Fault | None:
        return meaning(text, Condition("c", domain)).fault

    text = many.replace(" ", ", ")
    fault = check(text)
    assert fault is not None
    assert mend_of(text, fault, domain, check) == many


def test_there_is_no_mend_that_would_be_refused_again():
    fault = Fault("no.", mend='"still wrong"')
    assert mend_of("x", fault, None, lambda text: fault) == ""
