"""How a bucket is reached: credentials from the environment or a profile, time-outs, retries, and
what errors may say.

Credentials are read when a process first needs a bucket. They are kept in the client's memory
alone: paths, and lakes that are pickled for other processes, name the bucket; each process reads
its own environment. No message repeats them: what a server answers is cut to its first line and
searched for them before anybody reads it.
"""

from __future__ import annotations

import configparser
import functools
import importlib.util
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.errors import UsageError
from flagdata.storage.forks import OneProcess

if TYPE_CHECKING:
    from obstore.store import S3Store

REQUEST_TIMEOUT = 30.0
"""Most a single request takes before it counts as failed [s]."""
CONNECT_TIMEOUT = 5.0
"""Most that the making of a connection takes [s]."""
RETRIES = 12
"""How often a request that failed in the server or on the way is repeated, with growing waits."""
RETRY_TIMEOUT = 60.0
"""How long after its beginning a request is still repeated [s]."""
_ENVIRONMENT = {
    "aws_access_key_id": "AWS_ACCESS_KEY_ID",
    "aws_secret_access_key": "AWS_SECRET_ACCESS_KEY",
    "aws_session_token": "AWS_SESSION_TOKEN",
}
_SHOWN = 300  # letters of what a server said
_MESSAGE = re.compile(r"<Message>([^<]*)</Message>")
_STATUS = re.compile(r"status code: (\d{3} [A-Za-z ]+)")
COLOUR = re.compile(r"\x1b\[\d+m")
"""What the Delta library writes for terminals."""
_USER = re.compile(r"//[^/@\s]+@")
_ACCESS_KEY = re.compile(r"\b(?:AKIA|ASIA)[A-Z0-9]{12,}\b")


@functools.cache
def settings() -> dict[str, str]:
    """Credentials, region and end point, by the names that the Delta library has for them.

    Raises:
        UsageError: a profile that is not there, or that has no keys of its own.
    """
    credentials = {
        name: value
        for name, variable in _ENVIRONMENT.items()
        if (value := os.environ.get(variable))
    }
    profile = os.environ.get("AWS_PROFILE")
    profile_settings = _profile(
        profile or os.environ.get("AWS_DEFAULT_PROFILE") or "default", required=profile is not None
    )
    if profile is not None or "aws_access_key_id" not in credentials:
        credentials |= {
            name: profile_settings[name] for name in _ENVIRONMENT if name in profile_settings
        }
        if profile is not None and "aws_access_key_id" not in profile_settings:
            raise UsageError(
                f"the profile {profile!r} has no access key of its own",
                where="AWS_PROFILE",
                fix="put its keys into the environment: eval $(aws configure export-credentials "
                "--format env)",
            )
    region = (
        os.environ.get("AWS_REGION")
        or os.environ.get("AWS_DEFAULT_REGION")
        or profile_settings.get("region")
    )
    endpoint = (
        os.environ.get("AWS_ENDPOINT_URL_S3")
        or os.environ.get("AWS_ENDPOINT_URL")
        or profile_settings.get("endpoint_url")
    )
    credentials["aws_region"] = region or "us-east-1"
    if endpoint:
        credentials["aws_endpoint"] = endpoint
        if endpoint.startswith("http://"):
            credentials["aws_allow_http"] = "true"
    return credentials


def delta_options() -> dict[str, str]:
    """Returns what the Delta library needs to reach a bucket. It publishes by conditional puts too,
    said here so that a change of its defaults cannot undo it."""
    return {
        **settings(),
        "conditional_put": "etag",
        "timeout": f"{REQUEST_TIMEOUT:.0f}s",
        "connect_timeout": f"{CONNECT_TIMEOUT:.0f}s",
        "max_retries": str(RETRIES),
        "retry_timeout": f"{RETRY_TIMEOUT:.0f}s",
    }


_PROCESS = OneProcess("object storage", fix="start workers by spawn")


def client(bucket: str) -> S3Store:
    """Returns the client of a bucket, one a process.

    Raises:
        FlagdataError: the package obstore is not installed; or a forked child of a process that
            used one: it would hang there.
    """
    _PROCESS.check()
    return _client(bucket)


@functools.cache
def _client(bucket: str) -> S3Store:
    if importlib.util.find_spec("obstore") is None:
        raise UsageError(
            "a lake in object storage needs the package obstore",
            where=f"s3://{bucket}",
            fix="pip install 'flagdata[s3]'",
        )
    from datetime import timedelta

    from obstore.store import S3Store

    options = settings()
    return S3Store(
        bucket,
        config={  # type: ignore[arg-type]
            name: value for name, value in options.items() if name != "aws_allow_http"
        },
        client_options={
            "timeout": timedelta(seconds=REQUEST_TIMEOUT),
            "connect_timeout": timedelta(seconds=CONNECT_TIMEOUT),
            "allow_http": "aws_allow_http" in options,
        },
        retry_config={
            "max_retries": RETRIES,
            "retry_timeout": timedelta(seconds=RETRY_TIMEOUT),
            "backoff": {
                "init_backoff": timedelta(milliseconds=100),
                "max_backoff": timedelta(seconds=10),
                "base": 2,
            },
        },
    )


def plain(error: BaseException | str) -> str:
    """Shortens what a client or server said to one line, without credentials and colours."""
    text = COLOUR.sub("", str(error))
    line = " ".join((text.split("Debug source:")[0].split("<?xml")[0]).split()).rstrip(": ")
    if message := _MESSAGE.search(text):
        status = _STATUS.search(text)
        line = f"{status[1].strip()}: {message[1]}" if status else message[1]
    return redact_credentials(line)[:_SHOWN]


def redact_credentials(text: str) -> str:
    """Removes from `text` the credentials in use, the user of an address, and anything of the form
    of an access key."""
    for variable in _ENVIRONMENT:
        if (value := settings().get(variable)) and len(value) > 3:
            text = text.replace(value, "…")
    return _ACCESS_KEY.sub("…", _USER.sub("//…@", text))


def _profile(name: str, *, required: bool) -> dict[str, str]:
    """Reads what the files of profiles state of one."""
    home = Path.home() / ".aws"
    profile_settings: dict[str, str] = {}
    for variable, file, section in (
        ("AWS_CONFIG_FILE", "config", name if name == "default" else f"profile {name}"),
        ("AWS_SHARED_CREDENTIALS_FILE", "credentials", name),
    ):
        path = Path(os.environ.get(variable) or home / file)
        parser = configparser.RawConfigParser()
        try:
            parser.read(path, encoding="utf-8")
        except (
            configparser.Error,
            OSError,
            UnicodeDecodeError,
        ):  # whose text may show a line of the file
            raise UsageError(
                "the profiles cannot be read", where=str(path), fix="mend the file"
            ) from None
        if parser.has_section(section):
            profile_settings |= dict(parser.items(section))
    if required and not profile_settings:
        raise UsageError(
            f"there is no profile {name!r}",
            where="AWS_PROFILE",
            fix=f"name one of {home / 'config'}",
        )
    return profile_settings
