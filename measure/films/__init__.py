"""Closing the loop on films with logs of the wind, and on tables of observables: `measure.films.run.close_loop`."""
