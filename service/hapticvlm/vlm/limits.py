"""Every budget and limit of asking a vision-language model, each with its reason, in one place."""

from __future__ import annotations

# What is asked and believed.
LEAST_C = -30  # degC, the candidate numbers, each whole degree
MOST_C = 60
# Share of an answer that must be of candidates, in process and from an endpoint. With less, what is
# left over of a sentence that begins otherwise ("The air is ...") would be read as a number.
LEAST_SHARE = 0.5
# A model that is sure of one number is not thereby right, and a sentence states no interval. The
# paper counts an answer within 8 degC of the truth as right and had 13 of 15 right, so +- 8 degC is
# what is known to hold about COVERAGE of such answers. No reading is narrower.
HALF_WIDTH_C = 8.0
# Belief in a material that is named without a probability: enough to be rendered (ladder.KNOWN),
# not to end the climb (ladder.SURE). Set, not measured.
TEXT_BELIEF = 0.6
# A model's beliefs in materials are not calibrated: it never reaches the ladder's SURE by itself;
# the rest stays open.
TRUST = 0.75

# What a question may cost.
# Of a picture at most. The makers of Qwen2-VL advise 256 to 1,280: their `min_pixels` is
# 256 * 28 * 28. With fewer a model sees little of a whole scene.
IMAGE_TOKENS = 256
LEAST_TOKENS = 4  # what Qwen's image processor makes of the smallest picture
SIDE = 448  # px of a frame as it is decoded: at 28 px a token a square of it has IMAGE_TOKENS
ANSWER_TOKENS = 24  # a number and a few words; what a model writes after that is not read
# The same where a model refuses `max_tokens`: such models count what they think before they answer.
THINKING_TOKENS = 1024
TOP = 20  # log-probabilities a token, the most that OpenAI and vLLM give
ANSWER_BYTES = 1 << 20  # of an endpoint; one with 20 log-probabilities a token stays below 64 KiB
KEPT_HEADS = 4  # caches of instructions kept: ambient and a few scenes' material names

# How long things may take.
# Until an answer is there, unless `--vlm-timeout` says otherwise. One picture of IMAGE_TOKENS takes
# one thread of a processor 30 s (docs/MEASURED.md), a question about an object shows two.
ANSWER_S = 120.0
LOAD_S = 900.0  # a model may first have to come over the network
GRACE_S = 5.0  # beyond the model's own time limit, before the process is ended
NICE = 15  # of its process: everything else here goes first
LOADS = 2  # times that a model may fail to load running, before it is given up
