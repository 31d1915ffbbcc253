"""Episodes: every observation with its time, pose, picture and words, asked in many ways.

They lie beside the semantic map file, which stays the truth about places; episodes are the truth
about what was observed, when and from where.
"""
