"""Decision trees fitted by LightGBM, and written as the file that mapspeak reads."""

import json
from typing import Any

from mapspeak.spatial.rooms.borders import MEASURES
from mapspeak.spatial.rooms.joining import TreeSum, read_trees
from tools.roomfit.samples import Samples

N_TREES = 100
SETTINGS: dict[str, Any] = {
    "objective": "binary",
    "num_leaves": 5,
    "learning_rate": 0.15,
    "min_data_in_leaf": 300,
    "feature_fraction": 0.5,
    "bagging_fraction": 0.6,
    "bagging_freq": 1,
    "lambda_l2": 10.0,
    "seed": 1,
    "deterministic": True,
    "verbose": -1,
}


def fit_trees(samples: Samples) -> str:
    """Return trees as JSON."""
    # Nothing but this tool needs it: `pip install lightgbm`.
    import lightgbm  # noqa: PLC0415

    data = lightgbm.Dataset(samples.measures, samples.is_none, weight=samples.weights)
    booster = lightgbm.train(SETTINGS, data, N_TREES)
    trees = [_write_tree(tree["tree_structure"]) for tree in booster.dump_model()["tree_info"]]
    return '{"trees": [\n' + ",\n".join(json.dumps(tree) for tree in trees) + "\n]}\n"


def fit_judge(samples: Samples) -> TreeSum:
    """Return the judge that mapspeak would read."""
    return read_trees(fit_trees(samples))


def _write_tree(root: dict[str, Any]) -> list[Any]:
    """Return the nodes of a tree, the root first: a leaf's value, or what a node looks at."""
    nodes: list[Any] = []

    def add(node: dict[str, Any]) -> int:
        number = len(nodes)
        nodes.append(None)
        if "leaf_value" in node:
            nodes[number] = round(node["leaf_value"], 4)
            return number
        most = float(f"{node['threshold']:.5g}")
        children = add(node["left_child"]), add(node["right_child"])
        nodes[number] = [MEASURES[node["split_feature"]], most, *children]
        return number

    add(root)
    return nodes
