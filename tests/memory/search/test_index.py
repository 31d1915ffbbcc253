from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from embedding import ConceptEmbedder, shipped_model
from mapspeak.geometry import Pose
from mapspeak.memory import Landmark, SemanticMap, Waypoint, name_key
from mapspeak.memory.search.answer import (
    Answer,
    Basis,
    Entry,
    EntryKind,
    MatchField,
    MatchKind,
    Verdict,
    list_entries,
)
from mapspeak.memory.search.index import WORDS_ONLY, EntryIndex
from mapspeak.memory.search.meaningindex import TextVectors

HERE = Pose(0.0, 0.0)
MEMORY = SemanticMap(
    waypoints=(
        Waypoint(
            name="workshop",
            pose=HERE,
            description="A hall with a grey floor.\nThe bench is on the left.",
            safety_landmarks=(Landmark(label="extinguisher"), Landmark(label="first aid box")),
            functional_landmarks=(
                Landmark(label="ladder", purpose="used for reaching the upper racks"),
                Landmark(label="lathe", note="needs a key"),
            ),
            geometric_features=("corner of two walls",),
        ),
        Waypoint(
            name="kitchen",
            pose=HERE,
            safety_landmarks=(Landmark(label="extinguisher"),),
            functional_landmarks=(Landmark(label="sink"), Landmark(label="dishwasher")),
        ),
    )
)
ENTRIES = list_entries(MEMORY)


def by_words(query: str) -> Answer:
    return EntryIndex(ENTRIES).find(query)


def by_meaning(query: str) -> Answer:
    return EntryIndex(ENTRIES, vectors=TextVectors(ConceptEmbedder())).find(query)


def vectors_of(embedder: ConceptEmbedder | None) -> TextVectors | None:
    return None if embedder is None else TextVectors(embedder)


def is_one_kind(answer: Answer) -> bool:
    """Whether all that fit equally well are called the same."""
    return len({name_key(each.entry.name) for each in answer.candidates[: answer.n_meant]}) == 1


def ids(answer: Answer) -> list[str]:
    return [candidate.entry.id for candidate in answer.candidates]


def test_a_map_gives_each_place_and_each_landmark_with_what_is_said_of_them() -> None:
    place, extinguisher, *_ = ENTRIES

    assert [entry.id for entry in ENTRIES[:5]] == [
        "workshop",
        "workshop / extinguisher",
        "workshop / first aid box",
        "workshop / ladder",
        "workshop / lathe",
    ]
    assert (place.kind, place.features) == (EntryKind.PLACE, ("corner of two walls",))
    assert (extinguisher.kind, extinguisher.place) == (EntryKind.THING, "workshop")
    assert extinguisher.category == "safety equipment"


def test_one_label_twice_at_a_place_makes_two_entries() -> None:
    doors = (Landmark(label="Door"), Landmark(label="door"))
    place = Waypoint(name="hall", pose=HERE, functional_landmarks=doors)

    entries = list_entries(SemanticMap(waypoints=(place,)))

    assert [entry.id for entry in entries] == ["hall", "hall / door", "hall / door / 2"]


@pytest.mark.parametrize("query", ["ladder", "Ladder", "where is the ladder?", "ladders", "lader"])
@pytest.mark.parametrize("find", [by_words, by_meaning])
def test_a_name_is_found_whatever_its_form_and_spelling(
    query: str, find: Callable[[str], Answer]
) -> None:
    answer = find(query)

    assert answer.verdict is Verdict.FOUND
    assert ids(answer)[0] == "workshop / ladder"
    assert answer.candidates[0].basis is Basis.NAME


def test_a_misspelt_request_says_how_it_was_understood() -> None:
    answer = by_words("the firts aid box")

    assert answer.understood == "the first aid box"
    assert answer.candidates[0].evidence[0].kind is MatchKind.MISSPELT


@pytest.mark.parametrize("query", ["furst aid bxo", "dish washr", "the disch wascher please"])
@pytest.mark.parametrize("find", [by_words, by_meaning])
def test_a_misspelt_request_counts_as_the_name_that_it_looks_like(
    query: str, find: Callable[[str], Answer]
) -> None:
    answer = find(query)

    assert answer.verdict is Verdict.FOUND
    assert answer.candidates[0].basis is Basis.NAME
    assert answer.understood == answer.candidates[0].entry.name


def test_a_request_in_words_of_the_language_does_not_count_as_a_name_that_looks_like_it() -> None:
    ladder = Entry(id="l", kind=EntryKind.THING, name="light ladder")

    answer = EntryIndex([ladder]).find("night ladder")

    assert answer.understood == "night ladder"
    assert answer.verdict is Verdict.UNSURE


def test_a_kind_of_thing_that_is_not_remembered_is_said_to_be_missing() -> None:
    dryer = Entry(id="d", kind=EntryKind.THING, name="hand dryer")

    answer = EntryIndex([dryer]).find("a hair dryer")

    assert (answer.verdict, answer.missing) == (Verdict.NOT_REMEMBERED, "hair dryer")
    assert ids(answer) == ["d"]


def test_without_a_model_the_words_of_common_knowledge_tell_what_is_missing() -> None:
    dryer = Entry(id="d", kind=EntryKind.THING, name="hand dryer")

    answer = EntryIndex([dryer]).find("where can I dry my wet hair after swimming")

    assert (answer.verdict, answer.missing) == (Verdict.NOT_REMEMBERED, "hair dryer")


def test_a_word_is_no_form_of_another_that_ends_in_e() -> None:
    desk = Entry(id="d", kind=EntryKind.THING, name="desk")

    answer = EntryIndex([desk]).find("where can I sit")

    assert answer.missing != "floor plan"
    assert answer.verdict is Verdict.UNSURE


def test_words_that_agree_in_more_of_a_request_make_surer() -> None:
    things = ("workbench", "sofa", "sink", "clock")
    index = EntryIndex([Entry(id=each, kind=EntryKind.THING, name=each) for each in things])

    short, long = (
        index.find("relaxing"),
        index.find("stretching out for a nap in the evening, relaxing"),
    )

    assert (short.verdict, long.verdict) == (Verdict.UNSURE, Verdict.FOUND)
    assert ids(long)[0] == "sofa"


def test_a_kind_of_thing_that_only_a_description_names_is_remembered() -> None:
    kitchen = Entry(
        id="k", kind=EntryKind.PLACE, name="far end", description="A fridge hums there."
    )

    answer = EntryIndex([kitchen]).find("fridge")

    assert answer.verdict is not Verdict.NOT_REMEMBERED
    assert answer.missing is None


def test_what_is_more_like_a_thing_that_is_not_remembered_is_said_not_to_be() -> None:
    embedder = ConceptEmbedder()
    there = replace(embedder.thresholds.there, missing=-40.0)
    embedder.thresholds = replace(embedder.thresholds, there=there)
    blend = Entry(id="b", kind=EntryKind.PLACE, name="shelf sink")

    answer = EntryIndex([blend], vectors=TextVectors(embedder)).find("thirsty")

    assert answer.verdict is Verdict.NOT_REMEMBERED
    assert answer.missing is not None


@pytest.mark.parametrize("vectors", [None, TextVectors(shipped_model())])
@pytest.mark.parametrize(("request_", "among"), [("rooms with a sink", "sl"), ("sinks", "l")])
def test_what_is_remembered_by_its_whole_name_is_no_other_kind_that_is_missing(
    vectors: TextVectors | None, request_: str, among: str
) -> None:
    entries = [Entry(id=name[0], kind=EntryKind.THING, name=name) for name in ("sink", "ladder")]

    answer = EntryIndex(entries, vectors=vectors).find(request_, among=among)

    assert answer.missing is None


@pytest.mark.parametrize("find", [by_words, by_meaning])
@pytest.mark.parametrize("request_", ["stepladder", "step-ladder", "take me to the rolling ladder"])
def test_another_name_for_such_things_is_sure_in_one_word_or_two(
    find: Callable[[str], Answer], request_: str
) -> None:
    answer = find(request_)

    assert ids(answer)[0] == "workshop / ladder"
    assert answer.verdict is Verdict.FOUND


@pytest.mark.parametrize("find", [by_words, by_meaning])
def test_a_thing_is_found_by_another_name_for_such_things(find: Callable[[str], Answer]) -> None:
    answer = find("stepladder")

    assert ids(answer)[0] == "workshop / ladder"
    assert answer.verdict is not Verdict.NOT_REMEMBERED


def test_a_thing_is_found_by_its_usual_use_and_says_so() -> None:
    answer = by_words("changing a light bulb")

    assert ids(answer)[0] == "workshop / ladder"
    assert answer.candidates[0].field is MatchField.USE


def test_who_says_much_of_a_request_or_is_surely_meant_speaks_of_it() -> None:
    answer = by_words("ladder for the racks")

    assert [each.entry.id for each in answer.find_speaking(least_said_ratio=0.5)] == [
        "workshop / ladder"
    ]


def test_a_word_of_the_language_is_not_taken_for_a_misspelt_one() -> None:
    assert by_words("leather").understood == "leather"
    assert by_words("leather").verdict is Verdict.NOT_REMEMBERED


def test_what_is_meant_is_found_without_a_word_of_it_and_says_by_which_text() -> None:
    answer = by_meaning("I have to climb")

    assert ids(answer)[0] == "workshop / ladder"
    assert answer.candidates[0].basis is Basis.MEANING
    assert answer.candidates[0].evidence == ()
    assert answer.candidates[0].field is MatchField.LABEL
    assert answer.candidates[0].text == "ladder"


def test_the_nearest_text_may_be_a_sentence_of_the_description() -> None:
    hall = Waypoint(name="hall", pose=HERE, description="Long and dark.\nWater comes from there.")
    vectors = TextVectors(ConceptEmbedder())

    answer = EntryIndex(list_entries(SemanticMap(waypoints=(hall,))), vectors=vectors).find(
        "thirsty"
    )

    assert answer.candidates[0].field is MatchField.DESCRIPTION
    assert answer.candidates[0].text == "Water comes from there."


def test_without_a_model_only_words_are_found_and_the_answer_says_so() -> None:
    assert by_words("I have to clamber").verdict is Verdict.NOT_REMEMBERED
    assert by_words("I have to clamber").limits == WORDS_ONLY
    assert by_meaning("I have to climb").limits is None


def test_a_word_is_found_in_a_longer_one() -> None:
    lighthouse = Entry(id="l", kind=EntryKind.THING, name="lighthouse")

    answer = EntryIndex([*ENTRIES, lighthouse]).find("a house")

    assert ids(answer) == ["l"]
    assert answer.candidates[0].evidence[0].kind is MatchKind.PART


def test_things_of_one_name_are_several_of_one_kind() -> None:
    answer = by_meaning("extinguisher")

    assert answer.verdict is Verdict.SEVERAL
    assert (answer.n_meant, is_one_kind(answer)) == (2, True)
    assert set(ids(answer)[:2]) == {"kitchen / extinguisher", "workshop / extinguisher"}


def test_things_of_like_meaning_are_several_of_several_kinds() -> None:
    blanket = Entry(id="b", kind=EntryKind.THING, name="blanket")
    vectors = TextVectors(ConceptEmbedder())
    # Anybody knows that a first aid box is good for burns, too.
    others = [entry for entry in ENTRIES if entry.name != "first aid box"]

    answer = EntryIndex([*others, blanket], vectors=vectors).find("flames")

    assert answer.verdict is Verdict.SEVERAL
    assert (answer.n_meant, is_one_kind(answer)) == (3, False)


def test_only_what_may_be_chosen_is_found() -> None:
    index = EntryIndex(ENTRIES)

    answer = index.find("extinguisher", among={"kitchen / extinguisher", "kitchen / sink"})

    assert ids(answer) == ["kitchen / extinguisher"]
    assert answer.verdict is Verdict.FOUND


def test_leaving_the_likeliest_out_makes_the_next_no_surer() -> None:
    names = ("sink", "wash ladder", "wash ladder fire aid")
    entries = [Entry(id=name, kind=EntryKind.THING, name=name) for name in names]
    index = EntryIndex(entries, vectors=TextVectors(ConceptEmbedder()))

    answer = index.find("thirsty", among=set(names[1:]))

    assert ids(answer) == list(names[1:])
    assert answer.verdict is Verdict.UNSURE


@pytest.mark.parametrize("query", ["", "?!", "the", "where is it", "swimming pool"])
@pytest.mark.parametrize("find", [by_words, by_meaning])
def test_what_is_not_remembered_is_said(query: str, find: Callable[[str], Answer]) -> None:
    assert find(query).verdict is Verdict.NOT_REMEMBERED


@pytest.mark.parametrize("vectors", [None, TextVectors(ConceptEmbedder())])
def test_nothing_is_remembered_in_an_empty_memory(vectors: TextVectors | None) -> None:
    answer = EntryIndex([], vectors=vectors).find("ladder")

    assert (answer.verdict, answer.candidates, answer.n_meant) == (Verdict.NOT_REMEMBERED, (), 0)
    assert not is_one_kind(answer)


@pytest.mark.parametrize("request_", ["tool used for a fire", "the tool for fire"])
def test_the_tool_for_a_fire_is_the_extinguisher_before_the_hose_by_words_alone(
    request_: str,
) -> None:
    names = ("fire hose reel", "fire extinguisher", "fire blanket", "table")
    entries = [Entry(id=str(i), kind=EntryKind.THING, name=name) for i, name in enumerate(names)]
    assert EntryIndex(entries).find(request_).candidates[0].entry.name == "fire extinguisher"


def test_a_letter_after_a_name_tells_places_apart() -> None:
    aisles = [Entry(id=f"aisle {x}", kind=EntryKind.PLACE, name=f"aisle {x}") for x in "AB"]
    index = EntryIndex(aisles)

    assert ids(index.find("aisle A"))[0] == "aisle A"
    assert index.find("aisle A").verdict is Verdict.FOUND
    assert index.find("the aisle").verdict is Verdict.SEVERAL


def test_the_end_of_a_contraction_is_no_word() -> None:
    place = Waypoint(name="hall", pose=HERE, geometric_features=("2 m wide",))

    answer = EntryIndex(list_entries(SemanticMap(waypoints=(place,)))).find("I'm thirsty")

    assert answer.candidates == ()


def test_words_of_another_script_are_compared_as_words() -> None:
    places = SemanticMap(waypoints=(Waypoint(name="소화기 앞", pose=HERE),))
    vectors = TextVectors(ConceptEmbedder())

    answer = EntryIndex(list_entries(places), vectors=vectors).find("소화기")

    assert ids(answer) == ["소화기 앞"]
    assert answer.candidates[0].basis is Basis.WORDS


def test_only_texts_that_are_new_are_embedded_again() -> None:
    embedder = ConceptEmbedder()
    vectors = TextVectors(embedder)
    EntryIndex(ENTRIES, vectors=vectors)
    n_before = len(embedder.asked)

    EntryIndex([*ENTRIES, Entry(id="x", kind=EntryKind.THING, name="anvil")], vectors=vectors)

    assert embedder.asked[n_before:] == ["anvil"]
    assert len(set(embedder.asked)) == len(embedder.asked)


def test_a_request_costs_one_embedding() -> None:
    embedder = ConceptEmbedder()
    index = EntryIndex(ENTRIES, vectors=TextVectors(embedder))
    n_before = len(embedder.asked)

    index.find("something to drink")

    assert embedder.asked[n_before:] == ["something to drink"]


def test_kept_vectors_are_used_by_the_same_model_only(tmp_path: Path) -> None:
    path = tmp_path / "vectors.npz"
    first = TextVectors(ConceptEmbedder(), kept=path)
    first.find(["ladder", "sink"])
    first.keep()
    again, other = ConceptEmbedder(), ConceptEmbedder()
    other.name = "another"

    for embedder in (again, other):
        vectors = TextVectors(embedder, kept=path)
        vectors.find(["sink", "ladder"])

    assert again.asked == []
    assert other.asked == ["ladder", "sink"]


def test_vectors_are_kept_with_the_memory_and_not_asked_for_again(tmp_path: Path) -> None:
    folder = tmp_path / "places.memory"
    first = TextVectors(ConceptEmbedder(), kept=folder / "vectors.npz")
    first.find(["ladder", "sink"])
    first.keep()
    embedder = ConceptEmbedder()
    again = TextVectors(embedder, kept=folder / "vectors.npz")

    again.find(["sink", "ladder"])
    again.keep()

    assert embedder.asked == []
    assert [each.name for each in folder.iterdir()] == ["vectors.npz"]


def test_a_few_new_vectors_wait_for_more_or_for_the_end(tmp_path: Path) -> None:
    vectors = TextVectors(ConceptEmbedder(), kept=tmp_path / "vectors.npz")
    vectors.find(map(str, range(200)))
    vectors.keep_if_many()
    vectors.find(["ladder", "sink"])
    vectors.keep_if_many()
    assert len(TextVectors(ConceptEmbedder(), kept=tmp_path / "vectors.npz")) == 200
    vectors.keep()
    assert len(TextVectors(ConceptEmbedder(), kept=tmp_path / "vectors.npz")) == 202


def test_an_entry_under_another_id_is_not_indexed_anew() -> None:
    embedder = ConceptEmbedder()
    index = EntryIndex(ENTRIES, vectors=TextVectors(embedder))
    moved = [replace(each, id=f"{each.id} 2") for each in ENTRIES]
    n_new, n_asked = index.n_new, len(embedder.asked)

    index.hold({each.id: each for each in moved[1:]})

    assert (index.n_new, len(embedder.asked)) == (n_new, n_asked)
    for each in ENTRIES:
        new = EntryIndex(moved[1:], vectors=TextVectors(ConceptEmbedder()))
        assert index.find(each.name) == new.find(each.name)


def test_vectors_that_cannot_be_kept_are_used_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    vectors = TextVectors(ConceptEmbedder(), kept=tmp_path / "file" / "vectors.npz")

    vectors.find(["ladder"])
    vectors.keep()

    assert len(vectors) == 1


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04cut off", b"no archive"])
def test_kept_vectors_that_are_missing_or_broken_are_computed_again(
    content: bytes | None, tmp_path: Path
) -> None:
    path = tmp_path / "vectors.npz"
    if content is not None:
        path.write_bytes(content)

    vectors = TextVectors(ConceptEmbedder(), kept=path)

    assert len(vectors) == 0
    vectors.find(["ladder"])
    vectors.keep()
    assert [each.name for each in tmp_path.iterdir()] == ["vectors.npz"]


LABELS = ("ladder", "sink", "first aid box", "fire blanket", "water cooler", "shelf", "cut-off saw")
PURPOSES = (None, "used for washing", "used for reaching high places", "against flames")


@st.composite
def memories(draw: st.DrawFn) -> list[Entry]:
    said = draw(st.lists(st.tuples(st.sampled_from(LABELS), st.sampled_from(PURPOSES)), max_size=9))
    return [
        Entry(id=f"{number}", kind=EntryKind.THING, name=label, purpose=purpose)
        for number, (label, purpose) in enumerate(said)
    ]


REQUESTS = st.sampled_from(
    [*LABELS, "wash my hands", "it burns", "I cut my finger", "too high", "lader", "pool"]
)
MODELS = st.sampled_from([None, ConceptEmbedder()])


@settings(max_examples=50)
@given(memories(), REQUESTS, MODELS, st.randoms(use_true_random=False))
def test_the_order_of_the_records_does_not_matter(
    entries: list[Entry], query: str, embedder: ConceptEmbedder | None, random: Random
) -> None:
    shuffled = random.sample(entries, len(entries))
    answers = [
        EntryIndex(each, vectors=vectors_of(embedder)).find(query) for each in (entries, shuffled)
    ]

    assert answers[0] == answers[1]


@settings(max_examples=50)
@given(st.lists(memories(), min_size=2, max_size=4), REQUESTS, MODELS)
def test_after_any_changes_an_index_answers_as_one_made_from_nothing(
    states: list[list[Entry]], query: str, embedder: ConceptEmbedder | None
) -> None:
    index = EntryIndex(vectors=vectors_of(embedder))
    for entries in states:
        index.hold({each.id: each for each in entries})
        fresh = EntryIndex(entries, vectors=vectors_of(embedder))
        assert index.find(query) == fresh.find(query)
        assert index.find_called(query) == fresh.find_called(query)


@settings(max_examples=50)
@given(memories(), REQUESTS, MODELS)
def test_the_same_request_has_the_same_answer_every_time(
    entries: list[Entry], query: str, embedder: ConceptEmbedder | None
) -> None:
    index = EntryIndex(entries, vectors=vectors_of(embedder))

    assert index.find(query) == index.find(query)


@settings(max_examples=50)
@given(memories(), st.sampled_from(LABELS), MODELS)
def test_an_exact_name_always_wins(
    entries: list[Entry], name: str, embedder: ConceptEmbedder | None
) -> None:
    named = Entry(id="named", kind=EntryKind.THING, name=name)
    index = EntryIndex([*entries, named], vectors=vectors_of(embedder))

    answer = index.find(name.upper(), limit=20)

    meant = answer.candidates[: answer.n_meant]
    assert "named" in {candidate.entry.id for candidate in meant}
    assert {candidate.entry.name for candidate in meant} == {name}
    assert {candidate.score_ratio for candidate in meant} == {1.0}


DENYING = SemanticMap(
    waypoints=(
        Waypoint(name="corner", pose=HERE, description="An empty corner, no bin here."),
        Waypoint(name="hall", pose=HERE, description="A hall without a sink or a mirror."),
        Waypoint(name="copies", pose=HERE, description="There is no printer, but a plotter."),
        Waypoint(
            name="no entry",
            pose=HERE,
            safety_landmarks=(Landmark(label="no smoking sign", note="Without it people smoke."),),
        ),
    )
)


@pytest.mark.parametrize("absent", ["bin", "sink", "mirror", "printer"])
def test_what_a_description_says_is_not_there_is_not_found_by_it(absent: str) -> None:
    answer = EntryIndex(list_entries(DENYING)).find(absent)
    assert answer.verdict is Verdict.NOT_REMEMBERED
    assert not answer.candidates


@pytest.mark.parametrize("there", ["plotter", "empty corner", "no entry", "no smoking sign"])
def test_what_it_says_is_there_is_found_and_names_are_taken_as_they_are(there: str) -> None:
    assert EntryIndex(list_entries(DENYING)).find(there).candidates
