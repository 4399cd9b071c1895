"""Limits and budgets of questions to a vision-language model, each with its reason."""

from __future__ import annotations

# Candidates and beliefs.
LEAST_C = -30  # degC, the candidate numbers, each whole degree
MOST_C = 60
MOST_WIDTH_C = 30.0  # of a range that is an answer; the whole range is the question, repeated
# Least share of an answer's probability that must be on candidates, in process. A model that begins
# a sentence ("The air is ...") leaves a few per cent to numbers, and these must not be read as its
# answer.
LEAST_SHARE = 0.5
# A model that is sure of one number may still be wrong, and a sentence states no interval. The
# paper counts an answer within 8 degC of the truth as right and had 13 of 15 right, so +- 8 degC is
# known to hold about COVERAGE of such answers. No reading's interval is narrower.
HALF_WIDTH_C = 8.0
# Belief in a material that is named without a probability: enough to be rendered (ladder.KNOWN),
# too little to stop the ladder (ladder.SURE). Our choice, not measured.
TEXT_BELIEF = 0.6
# Factor on a model's beliefs in materials, which are not calibrated: so it never reaches the
# ladder's SURE by itself, and the rest stays unknown.
TRUST = 0.75

# Cost of a question.
# Largest number of tokens of a picture. The makers of Qwen2-VL advise 256 to 1,280 (their
# `min_pixels` is 256 * 28 * 28); with fewer a whole scene shows few details.
IMAGE_TOKENS = 256
LEAST_TOKENS = 4  # of the smallest picture that Qwen's image processor makes
SIDE = 448  # px of a decoded frame: at 28 px a token a square of it has IMAGE_TOKENS
ANSWER_TOKENS = 24  # a number and a few words; anything after them is not read
# The same for models that think first, whose thought counts; the time limit ends a longer one.
THINKING_TOKENS = 4096
ANSWER_BYTES = 1 << 20  # of an endpoint; a thought has some 20 KiB
KEPT_HEADS = 4  # cached instructions: ambient and a few scenes' material names

# Times.
# Limit of one answer, unless `--vlm-timeout` is given. A picture of IMAGE_TOKENS takes one thread
# of a processor 30 s (hapticvlm_lab/LOG.md), and a question about an object has two pictures.
ANSWER_S = 120.0
LOAD_S = 900.0  # a model may have to be downloaded first
GRACE_S = 5.0  # after the model's own time limit, before the process is killed
NICE = 15  # of its process: everything else of the service goes first
LOADS = 2  # failures to load in a row after which a model is given up
