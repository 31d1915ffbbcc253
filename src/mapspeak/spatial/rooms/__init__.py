"""Rooms, corridors, open spaces and doors: what a person would see in an occupancy grid."""

from mapspeak.spatial.rooms.along import CorridorWalk, DoorSide, PassedDoor, walk_along
from mapspeak.spatial.rooms.finding import find_rooms
from mapspeak.spatial.rooms.floor import build_cleared
from mapspeak.spatial.rooms.identity import match_rooms
from mapspeak.spatial.rooms.room_map import Door, Region, RoomClass, RoomMap, Vanished

__all__ = [
    "CorridorWalk",
    "Door",
    "DoorSide",
    "PassedDoor",
    "Region",
    "RoomClass",
    "RoomMap",
    "Vanished",
    "build_cleared",
    "find_rooms",
    "match_rooms",
    "walk_along",
]
