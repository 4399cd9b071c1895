"""The machine observer: a model of a participant, used to compare patterns; never a person."""
