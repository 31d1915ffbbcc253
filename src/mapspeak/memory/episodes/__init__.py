"""Episodes: every observation with its time, pose, picture and words, queried in many ways.

They are stored beside the semantic map file. That file is authoritative for places; episodes are
authoritative for what was observed, when and from where.
"""
