"""A fuzz harness: sound inputs are mutated at random and everything that reads them is run on the result.

``python -m tests.fuzz --mutations 20000 --seed N [--target NAME]``. A case is right where the code answers with
something that can be, or refuses with one line that says where, what it found and what it expected.
"""
