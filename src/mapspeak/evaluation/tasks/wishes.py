"""What people ask for without naming it, and the kinds of things that are meant."""

from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["FIRE", "FIRE_WISH", "WISHES"]

FIRE = "fire_extinguisher"
FIRE_WISH = "Fire detected nearby. Navigate to the tool used for it."
"""The paper's Task 3, word for word."""

WISHES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        FIRE: (
            "A waste paper basket is burning. Go to what puts it out.",
            "Something smoulders in here. Go to where I find what smothers the flames.",
        ),
        "first_aid_box": (
            "Somebody has cut a finger. Go to where plasters and bandages are kept.",
            "A colleague is bleeding. Go to what helps.",
        ),
        "exit_sign": (
            "Everybody has to leave the building. Go to what points out the way.",
            "I want to know where the way outside is marked. Go there.",
        ),
        "fire_hose_reel": (
            "The fire is too large for a hand-held device. Go to where water comes from the wall.",
        ),
        "eye_wash_station": (
            "Acid has splashed into somebody's face. Go to where it can be rinsed out of the eyes.",
        ),
        "ladder": (
            "A lamp near the ceiling is broken. Go to what I can climb up on to change it.",
        ),
        "charging_dock": (
            "Your battery runs low. Go to where you can get power.",
            "You look tired, robot. Go to where you are plugged in for the night.",
        ),
        "forklift": ("A heavy load has to be lifted onto a shelf. Go to the vehicle for that.",),
        "desk": (
            "I have to write a letter sitting down. Go to a place where people work on paper.",
        ),
        "cabinet": (
            "These papers have to be put away by the alphabet. Go to where files are kept.",
        ),
        "sofa": (
            "My back hurts, I would like to stretch out for a while. Go to where I can lie down.",
        ),
        "whiteboard": (
            "I would like to sketch an idea so that the whole team sees it. Go to where I can.",
        ),
        "printer": ("I need this document on paper. Go to the machine that puts it there.",),
        "fridge": ("The milk has to be kept cold. Go to where it does not go sour.",),
        "coffee_machine": (
            "I can hardly keep my eyes open. Go to where I get a hot drink for that.",
        ),
        "sink": ("My hands are sticky. Go to where I can wash them.",),
        "toilet": ("I have drunk too much tea and need some privacy. Go there.",),
        "trash_bin": (
            "I have finished my apple and hold the core. Go to where it can be thrown away.",
        ),
    }
)
"""By kind; each meant by nothing else in `mapspeak.simulator.worlds.models`."""
