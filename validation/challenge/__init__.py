"""The blind test of the diagnosis: effects concealed in MuJoCo, recordings diagnosed unseen, answers opened, scored."""
