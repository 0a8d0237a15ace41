"""The verdict in sentences, as a page, as words for a terminal and as JSON.

It may import `measure.verdict`, and the outcomes of `measure.loop` and of the stages before it.
"""
