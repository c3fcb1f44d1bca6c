"""Schemas of retention: the rules of a data directory, what they would remove, and what was removed."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from foveacam_server.foundation.schema import RequestModel, ResponseModel

RetainedKind = Literal["captures", "recordings", "stills", "clouds", "fixations", "exports"]


class RetentionRule(ResponseModel):
    """Limits of a kind: keep none older than `keep_days`, and the newest up to `keep_gb`; null: no limit."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    keep_days: Annotated[float, Field(gt=0.0, le=36500.0)] | None = None
    keep_gb: Annotated[float, Field(gt=0.0, le=1e6)] | None = None


class RetentionRules(ResponseModel):
    """The rules of a data directory; `automatic`: whether the server applies them once an hour."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    automatic: bool = False
    captures: RetentionRule = RetentionRule()
    recordings: RetentionRule = RetentionRule()
    stills: RetentionRule = RetentionRule()
    clouds: RetentionRule = RetentionRule()
    fixations: RetentionRule = RetentionRule()
    exports: RetentionRule = RetentionRule()

    def rule(self, kind: RetainedKind) -> RetentionRule:
        """Return the rule of a kind."""
        rules: dict[RetainedKind, RetentionRule] = {
            "captures": self.captures,
            "recordings": self.recordings,
            "stills": self.stills,
            "clouds": self.clouds,
            "fixations": self.fixations,
            "exports": self.exports,
        }
        return rules[kind]


class DueItem(ResponseModel):
    """An item that the rules would remove, and why; `for_good`: its kind has no trash, it is deleted."""

    kind: RetainedKind
    id: str
    name: str
    created_utc: str
    size_bytes: int
    why: str
    for_good: bool


class RetentionPreview(ResponseModel):
    """Preview of what the rules would remove now; `digest`: identifies exactly these items.

    `file`: of the rules.
    """

    file: str
    rules: RetentionRules
    items: list[DueItem]
    size_bytes: int
    digest: str


class RetentionRequest(RequestModel):
    """Digest of the preview to carry out."""

    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class RetentionApplied(ResponseModel):
    """The items moved to the trash or deleted for good."""

    items: list[DueItem]
    size_bytes: int
