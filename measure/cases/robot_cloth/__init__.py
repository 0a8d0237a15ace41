"""A real cloth held at its two upper corners by a robot and swung in still air: calibrated on some programmes, judged
on others, and repeats of one programme compared with each other."""
