"""What is asked of every robot that drives: explore, remember, ask, be refused, drive, forget."""

import itertools

from goldens.transcript import Transcript, ids_in

MOST_EXPLORING = 14
N_OF_A_KIND = 5
NOTES: tuple[tuple[str, str, list[str], list[str]], ...] = (
    ("north bay", "A bay with a long wall.", ["fire extinguisher"], ["loaded shelf", "pallet"]),
    ("gate 3", "A wide gate beside a charger.", ["emergency exit sign"], ["charger 1"]),
    ("gate 4", "The next gate.", ["fire extinguisher", "first aid kit"], ["charger 2"]),
    ("waiting corner", "Chairs along the wall.", [], ["chair", "coffee machine", "bin"]),
    ("printer nook", "A copier under a window.", ["smoke detector"], ["printer", "desk"]),
)
QUERIES = (
    "fire extinguisher",
    "something to put out a fire",
    "the tool for fire",
    "charger 2",
    "gate 3",
    "where can I sit",
    "coffee",
    "printer",
    "unicorn",
    "first-aid kit",
    "exit",
    "der Feuerlöscher",
    "the shelf in R1",
    "copy machine near gate 4",
    "fire extingisher",
)
ODD_PLACES = (
    "R999",
    "",
    "nowhere",
    "1e9, 2",
    "nan, 0",
    "between R1 and",
    "robot",
    "0, 0",
    "0,0,90",
)
SUPERLATIVES = (
    "smallest room",
    "the second-largest room",
    "farthest door",
    "between the two nearest doors",
    "R1 looking back through its door",
    "all rooms",
)
PHRASES = (
    "left of {0}",
    "between {0} and {1}",
    "corner of {0}",
    "middle of {0}",
    "in front of {1}",
    "end of {0}",
    "next to {1}",
    "the north side of {0}",
)


async def tour(play: Transcript, *, explores: bool = True) -> None:
    """Play all of it on a robot that has just been switched on."""
    await look(play)
    if explores:
        await explore(play)
    seen = await look(play)
    await remember(play, seen)
    await ask_the_map(play, await look(play))
    await ask_the_memory(play)
    await drive(play, seen)
    await close_and_open(play, seen)
    await repeat_the_paper(play)


async def look(play: Transcript) -> str:
    """Look at the map as a whole, at a part of it, and through the camera."""
    text = await play.call("look_at_map")
    await play.call("look_at_map", around="robot", radius_m=4.0, up="robot")
    await play.call("get_robot_pose")
    await play.call("look_through_camera")
    return text


async def explore(play: Transcript) -> None:
    """Explore with pauses at first, then to the end."""
    await play.call("explore", n_goals=2, stops_at_goals=True, wait_s=25)
    await play.call("look_at_map", layers=["frontiers"])
    await play.call("write_semantic_data", name="first stop", description="Seen while exploring.")
    for _ in range(MOST_EXPLORING):
        if '"driving"' not in await play.call("explore", wait_s=25):
            return


async def remember(play: Transcript, seen: str) -> None:
    """Note several places, one of them anew, some with what is no longer there or is no number."""
    rooms = ids_in(seen, "RCO")
    for (name, description, safety, functional), room in zip(
        NOTES, itertools.cycle(rooms or ["robot"]), strict=False
    ):
        await play.call("navigate_to", place=room, wait_s=25)
        await play.call("wait_for_goal", wait_s=25)
        await play.call(
            "write_semantic_data",
            name=name,
            description=description,
            safety_landmarks=[{"label": each, "bearing_deg": 20.0} for each in safety],
            functional_landmarks=[
                {"label": each, "bearing_deg": -30.0, "range_m": 1.5} for each in functional
            ],
            geometric_features=["straight wall"],
        )
    await play.call("write_semantic_data", name="gate 3", description="Gate.", gone=["charger 1"])
    await play.call("write_semantic_data", name="", description="")
    await play.call("write_semantic_data", name="far", description="Off the map.", x=1e6, y=0.0)


async def ask_the_map(play: Transcript, seen: str) -> None:
    """Ask for places of each kind, for what phrases mean, and for ways and sizes."""
    by_kind = {letter: ids_in(seen, letter)[:N_OF_A_KIND] for letter in "RCODFWT"}
    places = [each for ids in by_kind.values() for each in ids]
    for place in (*places, *ODD_PLACES):
        await play.call("describe_place", place=place)
        await play.call("check_goal", place=place)
        await play.call("look_at_map", around=place, radius_m=3.0)
    for phrase in PHRASES:
        for pair in itertools.pairwise(places[:4]):
            await play.call("check_goal", place=phrase.format(*pair))
    for phrase in SUPERLATIVES:
        await play.call("check_goal", place=phrase)
    await play.call("measure", places=["all rooms", "the two nearest doors"])
    await play.call("measure")
    await play.call("measure", places=places[:8], start="robot")
    for pair in itertools.combinations(places[:6], 2):
        await play.call("measure", places=[pair[1]], start=pair[0])
    for layers in (["rooms"], ["doors"], ["places"], ["frontiers"], ["path"], ["all"]):
        await play.call("look_at_map", layers=layers)


async def ask_the_memory(play: Transcript) -> None:
    """Ask what is where, what was seen when, and what is odd about it."""
    for query in QUERIES:
        await play.call("find_place", query=query)
    await play.call("find_place", query="fire extinguisher", near="robot", k=2)
    await play.call("find_place", query="fire extinguisher", room="R1")
    await play.call("find_place", query="charger", kind="thing", since="2h ago")
    await play.call("check_memory")
    await play.call("get_semantic_data")
    await play.call("get_semantic_data", name="gate 4")
    await play.call("get_semantic_data", query="charger")
    await play.call("get_semantic_data", name="no such place")
    await play.call("recall_episodes")
    for arguments in (
        {"words": "extinguisher"},
        {"label": "printer"},
        {"near": "robot", "radius_m": 3.0},
        {"near_seen": "coffee machine"},
        {"room": "R1"},
        {"since": "2h ago"},
        {"since": "tomorrow"},
        {"until": "09:00"},
        {"kind": "picture"},
        {"from_row": 5},
        {"picture_of": "P1"},
    ):
        await play.call("recall_episodes", **arguments)


async def drive(play: Transcript, seen: str) -> None:
    """Drive to ids, names and poses, in routes and searches; be refused, replaced and cancelled."""
    places = ids_in(seen, "RCODF")
    for place in (*places[:3], "gate 4", "fire extinguisher", *ODD_PLACES):
        await play.call("navigate_to", place=place, wait_s=25)
        await play.call("wait_for_goal", wait_s=25)
    await play.call("navigate_to", x=0.0, y=0.0, yaw_deg=90.0, wait_s=25)
    await play.call("navigate_to", x=500.0, y=0.0)
    await play.call("navigate_to", place="R1", x=1.0, y=1.0)
    await play.call("navigate_to", place=places[0] if places else "R1", wait_s=1)
    await play.call("navigate_to", x=0.0, y=0.0, wait_s=1)
    await play.call("wait_for_goal", goal_id="G1", wait_s=0)
    await play.call("cancel_goal")
    await play.call("cancel_goal", goal_id="G999")
    await play.call("follow_route", stops=[*places[-3:], "gate 3"], look=True, wait_s=25)
    for _ in range(4):
        await play.call("follow_route", wait_s=25)
    for seen_it in (None, False, False, True):
        said = {} if seen_it is None else {"seen": seen_it, "likely": 0.4}
        await play.call("search_for", thing="first aid kit", wait_s=25, **said)
    await play.call("turn", by_deg=90)
    await play.call("turn", to_yaw_deg=0)
    await play.call("look_around", n_pictures=3)
    await play.call("stop_robot")


async def close_and_open(play: Transcript, seen: str) -> None:
    """Note events, see ways change, and end the events."""
    places = ids_in(seen, "RCD")[:3] or ["R1"]
    for place, effect in zip(places, ("closed", "slow", "avoid"), strict=False):
        await play.call("note_event", text=f"{place} is being cleaned", place=place, effect=effect)
    await play.call("note_event", text="Visitors come", place="gate 4", begins="in 2h")
    await play.call("note_event", text="", place="nowhere")
    await play.call("look_at_map")
    await play.call("what_is_blocked")
    for place in places:
        await play.call("check_goal", place=place)
        await play.call("navigate_to", place=place, wait_s=25)
    for event in ("E1", "E2", "E2", "E99"):
        await play.call("end_event", event=event)
    await play.call("realign_memory")


async def repeat_the_paper(play: Transcript) -> None:
    """Use the paper's own tools, and what a careless model would send."""
    await play.call("subscribe_map_as_image")
    await play.call("draw_map_axis")
    await play.call("draw_robot_pose")
    await play.call("navigate_to")
    await play.call("look_at_map", unknown=True)
    await play.call("turn", by_deg=4000)
    await play.call("explore", n_goals=0)
