"""The words that cross doors: equipment, truth, belief, percept, message, command.

Nothing is imported here: whoever needs a word names its module, and so an agent that
imports `staniel.datatypes.belief` does not come near `staniel.datatypes.truth`.
"""
