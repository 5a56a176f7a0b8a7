"""A study that is flown in no time, and its parts."""

from staniel.studies import load_study

TEXT = """
name = "small"
question = "Does it work?"
base = "village"
seeds = 2
metrics = ["visible_fraction_fine", "longest_gap"]

[settings]
minutes = 0.15
"vehicles.count" = 1

[[factors]]
name = "aircraft"
label = "aircraft"
key = "aircraft.count"
values = [1, 2]

[[claims]]
text = "Two see more than one"
metric = "visible_fraction_fine"
at = { aircraft = 2 }
than = { aircraft = 1 }
expect = "higher"
"""


def small(folder, text=TEXT, name="small.toml", **changes):
    """The study as a file in `folder`, loaded."""
    return load_study(written(folder, text, name), **changes)


def written(folder, text=TEXT, name="small.toml"):
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file
