"""Rooms, corridors, open spaces and doors: what a person would see in an occupancy grid."""

from mapspeak.spatial.rooms.along import CorridorWalk, Side, Stop, walk_along
from mapspeak.spatial.rooms.finding import find_rooms
from mapspeak.spatial.rooms.identity import match_rooms
from mapspeak.spatial.rooms.room_map import Door, Region, RoomClass, RoomMap, Vanished
from mapspeak.spatial.rooms.settings import RoomSettings

__all__ = [
    "CorridorWalk",
    "Door",
    "Region",
    "RoomClass",
    "RoomMap",
    "RoomSettings",
    "Side",
    "Stop",
    "Vanished",
    "find_rooms",
    "match_rooms",
    "walk_along",
]
