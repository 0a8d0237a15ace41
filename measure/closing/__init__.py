"""`flagdata close-loop`: sources in; a verdict, its report, its models and what the lake keeps of them out.

It composes the stages of a verdict and may import all of them: `measure.loop` finds the numbers, `measure.report` the
words.
"""
