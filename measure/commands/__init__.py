"""The verbs of measuring: what each option means, the parts that it asks in turn, what is printed and written."""
