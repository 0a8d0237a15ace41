"""Why a store refused a request or did not answer, as what it is and with its own remedy.

A store names the cause by a code in its answer. Where the client has none, since the request was
one whose answer has no body or there was no answer, the store is asked once more, directly.
"""

from __future__ import annotations

import errno
import re
import time
from dataclasses import dataclass

from flagdata.storage.connection import COLOUR, plain, settings
from flagdata.storage.requests import SHORTLY, Answer, Unreachable, send_request

_NEEDS = {
    "GET": "s3:GetObject",
    "HEAD": "s3:GetObject (and s3:ListBucket)",
    "PUT": "s3:PutObject",
    "POST": "s3:PutObject",
    "DELETE": "s3:DeleteObject",
}
"""Actions that requests need permission for, by Amazon's names; those of an upload's parts are a
put's."""
_LISTING, _DELETING = (
    re.compile(r"list-type=2|list request"),
    re.compile(r"DeleteObjects|\?delete\b"),
)
_METHOD = re.compile(r"Error performing ([A-Z]+)")
_AHEAD = 240.0
"""From how many seconds on a difference of clocks explains a refusal: stores allow 15 minutes, some
of them 5."""
_CODE = re.compile(r"<Code>([\w.]+)</Code>|\(code: ([\w.]+)\)")
_STATUS = re.compile(r"status code[\s:↳]+(\d{3})")
_REGION = re.compile(
    r"<Region>([a-z0-9-]+)</Region>"
    r"|<Endpoint>(?:[^<]*\.)?s3[.-]([a-z]+-[a-z-]+-\d)\.[^<]*</Endpoint>"
)
_ACTION = re.compile(r"perform[\s:↳]+([\w-]+:\w+)")
_UNNAMED = {301, 302, 307, 308, 400, 401, 403, 503, 507, None}
"""States of answers that may have any of several causes."""


class StoreError(OSError):
    """What a store refused or did not answer; its message shows no credentials.

    Attributes:
        fix: what can be done about it.
        passing: whether the answer was cut off, or lost, by a store that answers again; the client
            repeats no request whose answer breaks off.
    """

    fix = "check the network and the store"
    passing = False


class DeniedError(StoreError, PermissionError):
    """The credentials do not permit it."""


class CredentialsError(StoreError, PermissionError):
    """The credentials are not valid, or not at this time, or there are none."""


class NoBucketError(StoreError):
    """There is no such bucket at this end point."""

    fix = (
        "make the bucket with the store's own tools, or check its name and the end point "
        "(AWS_ENDPOINT_URL)"
    )


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A cause of refusals.

    Attributes:
        what: is the matter; the store's own words follow it.
    """

    what: str
    fix: str
    kind: type[StoreError] = StoreError


_KEYS = "AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or AWS_PROFILE"
_MISSING = Cause(
    what="there are no credentials in the environment or in a profile",
    fix=f"set {_KEYS}",
    kind=CredentialsError,
)
_SLOW = Cause(
    what="the store asks for a lower request rate, and was asked again in vain",
    fix="run fewer commands on it at a time, or do it again later",
)
_FAILED = Cause(
    what="the store failed, and was asked again in vain",
    fix="do it again later; its operator has the reason",
)
_LACKING = Cause(
    what="the store cannot do this", fix="use a store that speaks the whole of S3's protocol"
)
_REDIRECTED = Cause(
    what="the store sends the request to another end point, as for a bucket that was made a short "
    "while ago",
    fix="set AWS_REGION to the bucket's region and AWS_ENDPOINT_URL, if at all, to the end point "
    "of that region; for a"
    " new bucket do it again in an hour",
)
_ABROAD = (
    "PermanentRedirect",
    "AuthorizationHeaderMalformed",
    "IllegalLocationConstraintException",
)
_CLOCK = ("RequestTimeTooSkewed", "RequestExpired", "RequestInTheFuture")
_CAUSES = {
    ("ExpiredToken", "ExpiredTokenException", "TokenRefreshRequired"): Cause(
        what="the credentials have expired",
        fix="get new ones and set AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN, "
        "or renew the profile",
        kind=CredentialsError,
    ),
    ("InvalidToken", "InvalidSecurity", "UnrecognizedClientException"): Cause(
        what="the session token is not of these credentials",
        fix="set AWS_SESSION_TOKEN together with the keys that it was given with, or unset it",
        kind=CredentialsError,
    ),
    ("InvalidAccessKeyId", "InvalidClientTokenId", "NotSignedUp"): Cause(
        what="the store does not know the access key",
        fix="check the credentials: AWS_ACCESS_KEY_ID, or AWS_PROFILE, and that they are of the "
        "store at"
        " AWS_ENDPOINT_URL",
        kind=CredentialsError,
    ),
    ("SignatureDoesNotMatch",): Cause(
        what="the secret key is not that of the access key",
        fix="check the credentials: AWS_SECRET_ACCESS_KEY, or AWS_PROFILE, without spaces or "
        "quotes around",
        kind=CredentialsError,
    ),
    ("MissingSecurityHeader", "MissingAuthenticationToken", "CredentialsNotSupported"): _MISSING,
    (
        "SlowDown",
        "TooManyRequests",
        "TooManyRequestsException",
        "Throttling",
        "ThrottlingException",
        "RequestThrottled",
        "RequestLimitExceeded",
        "BandwidthLimitExceeded",
    ): _SLOW,
    ("ServiceUnavailable", "InternalError", "InternalServerError", "RequestTimeout"): _FAILED,
    ("NotImplemented", "MethodNotAllowed"): _LACKING,
    ("TemporaryRedirect", "Redirect"): _REDIRECTED,
    ("SecondLevelDomainForbidden", "PathStyleDomainForbidden", "PathStyleRequestForbidden"): Cause(
        what="the store wants the bucket's name in the host's",
        fix="set AWS_VIRTUAL_HOSTED_STYLE_REQUEST=true and AWS_ENDPOINT_URL to https://BUCKET.HOST",
    ),
    ("InvalidObjectState",): Cause(
        what="the object is in an archive",
        fix="restore it from its storage class by the store's own tools",
    ),
    (
        "QuotaExceeded",
        "EntityTooLarge",
        "XMinioStorageFull",
        "InsufficientStorage",
        "InsufficientCapacity",
    ): Cause(
        what="the store has no room for it",
        fix="free some space in the store, or ask for a larger quota",
    ),
    ("AllAccessDisabled", "AccountProblem"): Cause(
        what="the account is closed or suspended",
        fix="ask the store's operator",
        kind=CredentialsError,
    ),
    (
        "KMS.DisabledException",
        "KMS.NotFoundException",
        "KMS.InvalidStateException",
        "KMS.KMSInvalidStateException",
    ): Cause(
        what="the key of the key service that encrypts the bucket cannot be used",
        fix="have that key enabled, or the bucket given another one",
    ),
}
_BY_CODE = {code: cause for codes, cause in _CAUSES.items() for code in codes}
_BY_STATUS = {
    429: _SLOW,
    501: _LACKING,
    405: _LACKING,
    307: _REDIRECTED,
    302: _REDIRECTED,
    308: _REDIRECTED,
}


def refusal(error: BaseException, *, bucket: str, where: str) -> StoreError:
    """Turns what a request ended with in place of an answer into an error.

    Args:
        error: of the client, or of the Delta library.
        where: the place that was asked for.
    """
    text = COLOUR.sub("", str(error))
    status = int(state[1]) if (state := _STATUS.search(text)) else None
    code = _first(_CODE, text)
    needs = _needs(text)
    cause = _cause(code, status, text, bucket=bucket, needs=needs)
    passing = False
    if cause is None and status in _UNNAMED:
        answer = send_request(bucket, {"list-type": "2", "max-keys": "1"}, waits=SHORTLY)
        if isinstance(answer, Unreachable) and status is None and code is None:
            cause = Cause(what=answer.what, fix=answer.fix)
        elif isinstance(answer, Answer):
            cause = _answered_cause(answer, bucket=bucket, needs=needs, refused=status)
            passing = cause is None and status is None
    if cause is None:
        cause = _of_status(status, needs)
    store_said = (
        plain(error)
        if cause.what == "" or "<Message>" in text
        else ""
        if state is None
        else state[0]
    )
    message = (
        f"{cause.what} ({store_said})" if cause.what and store_said else cause.what or store_said
    )
    error_found = _error(cause, message, where)
    error_found.passing = passing
    return error_found


def refusal_of(answer: Answer | Unreachable, *, bucket: str, where: str, needs: str) -> StoreError:
    """Returns the error for an answer that is not what was asked for.

    Args:
        needs: the action that had to be permitted.
    """
    if isinstance(answer, Unreachable):
        return _error(Cause(what=answer.what, fix=answer.fix), answer.what, where)
    text = answer.body.decode(errors="replace")
    cause = _cause(answer.code, answer.status, text, bucket=bucket, needs=needs) or _of_status(
        answer.status, needs
    )
    return _error(
        cause,
        f"{cause.what or 'the store answered otherwise'} (status code: {answer.status})",
        where,
    )


def store_time(bucket: str) -> float:
    """Reads the store's clock, which gives objects their times [s since 1970].

    Raises:
        StoreError: it did not answer, or stated no time.
    """
    answer = send_request(bucket, {"location": ""}, method="HEAD")
    if isinstance(answer, Unreachable):
        raise refusal_of(answer, bucket=bucket, where=f"s3://{bucket}", needs="")
    if answer.date is None:
        raise StoreError(
            errno.EREMOTEIO, "the store's answers do not state its time (Date)", f"s3://{bucket}"
        )
    return answer.date.timestamp()


def _error(cause: Cause, text: str, where: str) -> StoreError:
    permitted = not issubclass(cause.kind, PermissionError)
    error = cause.kind(errno.EREMOTEIO if permitted else errno.EACCES, text, where)
    error.fix = cause.fix
    return error


def _first(pattern: re.Pattern[str], text: str) -> str | None:
    """Returns what the first of a pattern's groups matched."""
    match = pattern.search(text)
    return next(filter(None, match.groups()), None) if match else None


def _needs(text: str) -> str:
    """Names the action that a request of the client needed."""
    if _LISTING.search(text):
        return "s3:ListBucket"
    if _DELETING.search(text):
        return _NEEDS["DELETE"]
    method = _METHOD.search(text)
    return _NEEDS.get(method[1], "the action") if method else "the action"


def _cause(
    code: str | None, status: int | None, text: str, *, bucket: str, needs: str
) -> Cause | None:
    """Finds the cause that a code names."""
    if code in _ABROAD:
        return _abroad(_first(_REGION, text) or _region_of(bucket))
    if code == "NoSuchBucket":
        return Cause(
            what=f"there is no bucket {bucket!r}", fix=NoBucketError.fix, kind=NoBucketError
        )
    if code in _CLOCK:
        answer = send_request(bucket, {"location": ""}, method="HEAD", waits=SHORTLY)
        return _skewed_cause(_ahead(answer) if isinstance(answer, Answer) else None)
    if code is not None and (action := _ACTION.search(text)):
        return _denied_cause(action[1])
    if code in ("AccessDenied", "Forbidden") or status == 401:
        return _denied_cause(needs) if "aws_access_key_id" in settings() else _MISSING
    return _BY_CODE.get(code or "")


def _answered_cause(
    answer: Answer, *, bucket: str, needs: str, refused: int | None
) -> Cause | None:
    """Finds the cause that the store's answer to another request shows."""
    region = answer.headers.get("x-amz-bucket-region")
    if answer.status != 200 and region is not None and region != settings()["aws_region"]:
        return _abroad(region)
    ahead = _ahead(answer)
    if refused == 403 and ahead is not None and abs(ahead) > _AHEAD:
        return _skewed_cause(ahead)
    if answer.status == 301:
        return _abroad(None)
    if answer.status in _BY_STATUS:
        return _BY_STATUS[answer.status]
    if answer.status != 200 and "aws_access_key_id" not in settings():
        return _MISSING
    text = answer.body.decode(errors="replace")
    if answer.code is None or (answer.code == "AccessDenied" and not _ACTION.search(text)):
        return None  # a list may be denied where all else is not
    return _cause(answer.code, answer.status, text, bucket=bucket, needs=needs)


def _of_status(status: int | None, needs: str) -> Cause:
    if status in (401, 403):
        return _denied_cause(needs) if "aws_access_key_id" in settings() else _MISSING
    if status in _BY_STATUS:
        return _BY_STATUS[status]
    if status is not None and status >= 500:
        return _FAILED
    return Cause(what="", fix=StoreError.fix)


def _abroad(region: str | None) -> Cause:
    """Returns the cause that the bucket is in another region than requests are signed for."""
    used = settings()["aws_region"]
    end = ", and AWS_ENDPOINT_URL, if it is set, to the end point of that region"
    if region is None or region == used:
        return Cause(
            what=f"the bucket is in another region than {used}",
            fix=f"set AWS_REGION to the bucket's region{end}",
        )
    return Cause(
        what=f"the bucket is in the region {region}, not in {used}",
        fix=f"set AWS_REGION={region}{end}",
    )


def _skewed_cause(ahead: float | None) -> Cause:
    if ahead is None or abs(ahead) < _AHEAD:
        message = "this machine's clock differs from the store's"
    else:
        side = "ahead of" if ahead > 0 else "behind"
        message = f"this machine's clock is {abs(ahead) / 60:.0f} min {side} the store's"
    return Cause(what=message, fix="set this machine's clock (by NTP)", kind=CredentialsError)


def _denied_cause(needs: str) -> Cause:
    if needs.startswith("kms:"):
        fix = f"have {needs} permitted on the key that encrypts the bucket"
        return Cause(what="the key service does not permit it", fix=fix, kind=DeniedError)
    fix = (
        f"have {needs} permitted (by the policies of user and bucket), or give other credentials: "
        f"{_KEYS}"
    )
    return Cause(what=f"{needs} is not permitted", fix=fix, kind=DeniedError)


def _region_of(bucket: str) -> str | None:
    answer = send_request(bucket, {"location": ""}, method="HEAD", waits=SHORTLY)
    return answer.headers.get("x-amz-bucket-region") if isinstance(answer, Answer) else None


def _ahead(answer: Answer) -> float | None:
    """Computes by how much this machine's clock is ahead of the store's [s]."""
    return None if answer.date is None else time.time() - answer.date.timestamp()
