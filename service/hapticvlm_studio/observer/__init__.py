"""The machine observer: a computational model of a participant, used to compare patterns.

It is a model, not a person. It predicts which patterns are hard to tell apart from what is known of
skin and its noise; no person has been compared with it, except that its two noises are fitted to
the published figures of one study (docs/physics.md 5). Its answers are never reported as a
person's.

The way of one presentation: `presented` renders the pattern by the service's own session, voices
and simulated plate; `channels` and `percepts` reduce vibration and heat to features in Weber steps;
`answers` adds noise and chooses the most likely pattern; `predict` repeats this and counts.
"""
