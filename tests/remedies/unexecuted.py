"""Remedies that no test types, with the reason."""

from __future__ import annotations

BY_REASON: dict[str, tuple[tuple[str, str], ...]] = {
    "a bucket, with an upload that was cut off or an object that was changed": (
        ("flagdata/lake/health.py", "; flagdata gc aborts it"),
        ("flagdata/core/files/object_cache.py", "run flagdata verify: it"),
    ),
    "a lake that a version wrote whose branches were files alone": (
        ("flagdata/lake/marking.py", "give the flagdata push o"),
        ("flagdata/lake/removal.py", "mend what flagdata docto"),
    ),
    "a change of bytes between two reads": (("flagdata/lake/copying.py", "run flagdata verify"),),
    "a definition, no remedy": (("flagdata/pages/glossary.py", "A regression that makes"),),
    "a disk that fails while it confirms": (
        ("flagdata/core/files/durable.py", "check the disk, then run"),
    ),
    "a film of a minute or more that is itself looked at by a network, beside a log whose clock is "
    "off": (
        ("measure/anemometer/reading_calibration.py", "align the film with the"),
        ("measure/anemometer/reading_calibration.py", "check the clocks with fl"),
        ("measure/measuring_model/window_features.py", "choose another part by -"),
        ("measure/measuring_model/window_features.py", "give another film, or --"),
    ),
    "a film whose stamps have gaps in every window, yet at least one window long": (
        ("measure/estimate/film_measuring.py", "frames are missing or rep"),
    ),
    "a film, real or rendered, whose flag or camera is lost in the whole and found in a part": (
        ("measure/cloth/flag_recordings.py", "film from a tripod, or c"),
        ("measure/cloth/observed_recording.py", "look at the flag on the "),
        ("measure/commands/observe.py", "give --crop around one w"),
        ("measure/film/conditioned_film.py", "choose a part of the fil"),
        ("models/conditioning/conditioning.py", "give --crop around the f"),
    ),
    "a full disk, while inputs are prepared from a data set that was built": (
        ("models/training/inputs.py", "free some space or name"),
    ),
    "a heading, no remedy": (("sim/run/member_batch.py", "flagdata simulate"),),
    "a flag that cannot be simulated among those of a shard": (
        ("sim/datasets/build.py", "build the data set without --shard"),
    ),
    "a machine that kills the processes of a build, three times": (
        ("sim/workers/local.py", "see whether it lacks mem"),
    ),
    "a lake that fails while a command says what it published before another failure": (
        ("flagdata/core/console.py", "what was finished before"),
    ),
    "a log entry that is no JSON of ours under its right hash: one of another program": (
        ("flagdata/lake/lineage.py", "run flagdata verify; "),
        ("flagdata/lake/refs.py", "run flagdata verify; "),
    ),
    "a log that a reader accepts for its other channels, beside a film of markers": (
        ("measure/trajectories/wind_tracks.py", "see what flagdata ingest"),
    ),
    "a record without frames or wind that stands as a row: no command commits one": (
        ("flagdata/export/lerobot.py", "leave it out by --where"),
        ("flagdata/export/mp4.py", "leave it out by --where"),
        ("flagdata/export/wind_csv.py", "leave it out by --where"),
        ("flagdata/ingest/records.py", "see flagdata doctor"),
    ),
    "a ref or parent that is lost between a command's first look at the lake, which names it, and "
    "its work": (
        ("flagdata/lake/catalog.py", "it lists the refs that c"),
        ("flagdata/lake/lineage.py", "run flagdata doctor"),
        ("flagdata/lake/merging.py", "run flagdata doctor"),
        ("flagdata/record/record_bytes.py", "check the path, or run f"),
    ),
    "a trained network, and a film on which its answer lies at an end or contradicts what is given": (
        ("measure/estimate/film_answer.py", "check --flag-size, with"),
        ("measure/gate/gate_verdict.py", "crop to the flag by --cr"),
        ("measure/gate/gate_verdict.py", "give --flag-size, the le"),
        ("measure/estimate/film_posterior.py", "weigh the cloth and give"),
        ("measure/gate/reasons.py", "give the part in which t"),
        ("measure/estimate/film_measuring.py", "check --area-weight and"),
        ("measure/estimate/film_measuring.py", "check --flag-size"),
        ("measure/estimate/film_measuring.py", "choose a part of the fil"),
        ("measure/estimate/film_measuring.py", "give the wind of single"),
    ),
    "a training, for minutes, on a data set that was built": (
        ("flagdata/dataset/resolve.py", "align recordings first,"),
        ("flagdata/dataset/pair_table.py", "run flagdata doctor"),
        ("models/training/checkpoint.py", "name another folder by -"),
        ("models/training/train_command.py", "wait until it has ended,"),
        ("models/training/training_recipe.py", "build it first: flagdata build"),
    ),
    "an error that is caught: the message which is printed in its place says --start": (
        ("flagdata/ingest/camera/recording_start.py", "give --start"),
    ),
    "asked and answered at a terminal; tests/flagdata/ingest/test_confirm.py answers": (
        ("flagdata/commands/confirm_recipe.py", "describe the file by a r"),
    ),
    "each finding that leads here has a fix of its own, which is said instead": (
        ("flagdata/lake/marking.py", "run flagdata doctor"),
        ("flagdata/lake/copying.py", "run flagdata doctor"),
    ),
    "each guess that is no recording says what to do by itself": (
        ("flagdata/ingest/classification.py", "see flagdata ingest --sn"),
    ),
    "it is for the start file of a shell; tests/contract completes in each shell": (
        ("flagdata/commands/completion.py", "flagdata completion fish"),
        ("flagdata/commands/completion.py", 'ion bash)"  in ~/.bashrc'),
        ("flagdata/commands/completion.py", "~/.zshrc, after compinit"),
    ),
    "it is of the programs of a cloud": (
        ("flagdata/storage/connection.py", "put its keys into the en"),
    ),
    "it needs Blender's environment, or makes one of 1 GB": (
        ("sim/blender/blender_setup.py", "flagdata blender-setup"),
        ("sim/blender/environment.py", "ame an environment with"),
        ("sim/blender/environment.py", "and name it with --pyth"),
        ("sim/blender/environment.py", "flagdata blender-setup"),
        ("sim/blender/environment.py", "make its environment wit"),
        ("sim/blender/environment.py", "run flagdata blender-setup"),
        ("sim/blender/environment.py", "set it to the Python of"),
        ("sim/blender/environment.py", "setup, which installs it"),
        ("sim/blender/environment.py", "the environment of flagd"),
        ("sim/blender/environment.py", "try again on a machine t"),
    ),
    "more recordings than the simulations that a test can run tell apart": (
        ("measure/cloth/emulator.py", "give fewer recordings, o"),
    ),
    "said by `import flagdata` only: the command takes the other way": (
        ("flagdata/align/cloth_recording.py", "name a camera artifact;"),
        ("flagdata/align/windpair.py", "flagdata align REFERENCE"),
        ("flagdata/api/recordings.py", "; look at them with flag"),
        ("measure/trajectories/markers.py", "name a marker artifact;"),
    ),
    "said to a browser, by a page; tests/flagdata/view opens the addresses": (
        ("flagdata/view/server.py", "open the whole address t"),
        ("flagdata/view/server.py", "open the address that fl"),
        ("flagdata/view/server.py", "open the whole address t"),
    ),
    "several flags that a network refuses to tell apart": (
        ("measure/gate/reasons.py", "choose one by --flag, or"),
    ),
    "what nobody foresaw cannot be provoked; tests/contract has --debug": (
        ("flagdata/core/console.py", "this is a defect of flag"),
    ),
    "a page's advice for the next film, no remedy; tests/measure/cloth and anemometer read it": (
        ("measure/anemometer/reading_answer.py", "For other films of it: <"),
        ("measure/cloth/calibration_answer.py", "For <code>flagdata measu"),
    ),
    "wrong bytes under right checksums: a damage is found by those before, with a remedy of its own": (
        ("flagdata/export/mcap.py", "run flagdata verify"),
        ("flagdata/lake/marker_sequences.py", "run flagdata verify; ing"),
        ("flagdata/lake/mesh_sequences.py", "run flagdata verify; imp"),
        ("flagdata/record/messages.py", "run flagdata verify"),
        ("flagdata/record/reader.py", "run flagdata verify"),
        ("flagdata/record/salvage.py", "run `flagdata recover` o"),
        ("flagdata/record/video_archive.py", "run flagdata verify"),
        ("flagdata/view/media.py", "run flagdata verify"),
        ("measure/measuring_model/reading_model_folder.py", "run flagdata verify; cal"),
        ("measure/closing/verdict_artifacts.py", "run flagdata verify; clo"),
        ("measure/commands/measurement_artifact.py", "run flagdata verify; mea"),
    ),
}
"""Reason → module of the remedy, and enough of its words to distinguish it from others of the
module."""
UNEXECUTED = tuple(
    (module, words, reason) for reason, rows in BY_REASON.items() for module, words in rows
)
