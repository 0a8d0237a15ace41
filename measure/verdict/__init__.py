"""What a verdict is: its record of plain values, the thresholds it depends on, and how its quantities are written.

It imports no other stage of a verdict, and any may import it.
"""
