"""What the words of a heading say, in the languages of common loggers."""
