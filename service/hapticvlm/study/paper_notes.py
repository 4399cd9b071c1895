"""What the paper prints of its statistics, and what does not fit together. Facts and words only.

F is recovered: the value of two decimals that gives both the printed p and the printed effect size.
"""

# Effect, F, its printed degrees of freedom, those of a 5 x 2 design with nine people, printed p.
PRINTED = (
    ("vibration", 1.92, (9, 72), (4, 32), 0.0625),
    ("temperature", 2.59, (1, 8), (1, 8), 0.146),
    ("vibration x temperature", 1.05, (9, 72), (4, 32), 0.410),
)
NOTES = (
    "F(9, 72) belongs to one factor of ten levels and nine people. The study crosses five "
    "vibrations with two temperatures, for which vibration and interaction have F(4, 32); crossing "
    "ten patterns with temperature is degenerate, because temperature is already in the pattern.",
    "Printed p and partial eta squared agree with the printed F, so the figures are consistent "
    "with each other; it is the label of the design that is not.",
    "0.193 and 0.244 are called medium; by the usual 0.14 they are large. Nine people who differ "
    "insignificantly do not show that patterns are recognised alike.",
    "'None significant, all corrected p = 1.000' cannot follow from these counts by pooled tests: "
    "wood carving hot is right 45 of 45 times, fabric rubbing cold 34 of 45. A test by person "
    "could still come out so; it cannot be repeated from the table.",
    "The mean of the printed cells is 84.6 %, of the counts 84.67 %: rounding. It is how well "
    "people told patterns apart; the paper gives no accuracy of its vision module.",
    "To run the ANOVA, the pairwise tests by person and an interval that respects people, each "
    "person's trials are needed: participant, presented and answered pattern, in order. Reaction "
    "times, levels, setpoints and whether sound was masked are not given either.",
)
