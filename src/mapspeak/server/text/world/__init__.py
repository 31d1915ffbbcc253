"""The words for the map and the robot on it: looks, tables, descriptions, ways, drives."""
