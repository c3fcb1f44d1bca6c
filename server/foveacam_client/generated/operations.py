# Written by .ci/generate_client.py; do not edit.
"""Every operation of the API: a class a noun, a method an operation."""

import builtins
from collections.abc import Generator
from typing import Literal

from foveacam_client.call import Call, StartedJob
from foveacam_client.document import JsonObject
from foveacam_client.generated import models
from foveacam_client.generated.transport import Download, Transport


class Acceptances:
    """Operations of `acceptances`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.AcceptanceDocument]:
        """All acceptance runs, newest first.

        Return the results of all runs, those that were ended early too.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/acceptances"), builtins.list[models.AcceptanceDocument]
        )

    def create(
        self, body: models.AcceptanceRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.AcceptanceDocument]:
        """Run the acceptance.

        Queue a run of ten minutes or so; it moves mirrors and pan-tilt, and changes no calibration.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/acceptances", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.AcceptanceDocument,
        )

    def get(self, acceptance_id: str) -> models.AcceptanceDocument:
        """One acceptance run.

        Return the result of one run.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/acceptances/{acceptance_id}", path_values={"acceptance_id": acceptance_id}),
            models.AcceptanceDocument,
        )

    def picture(self, acceptance_id: str, name: str) -> Download:
        """Picture of an acceptance run.

        Return a picture of one check.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/acceptances/{acceptance_id}/pictures/{name}.png",
                path_values={"acceptance_id": acceptance_id, "name": name},
            )
        )

    def report(self, acceptance_id: str) -> Download:
        """Report of an acceptance run.

        Return the report: findings, figures with their limits, pictures, Table 2.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/acceptances/{acceptance_id}/report.html",
                path_values={"acceptance_id": acceptance_id},
            )
        )


class Archive:
    """Operations of `archive`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.ArchiveDocument:
        """The archive of this server.

        Return the address of the archive of captures, recordings and stills.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/archive"), models.ArchiveDocument)


class Audit:
    """Operations of `audit`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(
        self,
        *,
        text: str | None = None,
        who: str | None = None,
        outcome: Literal["", "done", "refused", "failed"] | None = None,
        before: int | None = None,
        limit: int | None = None,
    ) -> models.AuditPage:
        """Who changed what.

        Return the newest changes and attempts of changes, newest first.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call(
                "GET",
                "/api/v1/audit",
                query={"text": text, "who": who, "outcome": outcome, "before": before, "limit": limit},
            ),
            models.AuditPage,
        )

    def audit_lines(self) -> Download:
        """All changes, as JSON lines.

        Return the whole audit log, one JSON object a line, oldest first.

        Needs the right `administer`.
        """
        return self._transport.download(Call("GET", "/api/v1/audit.jsonl"))


class Batches:
    """Operations of `batches`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.BatchDocument]:
        """All batches.

        Return all batches, by id.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/batches"), builtins.list[models.BatchDocument])

    def make(
        self, body: models.BatchRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.BatchDocument]:
        """Make products of several captures.

        Queue a batch, or the rest of an equal one, as a job that leaves the rig free.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/batches", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.BatchDocument,
        )

    def cluster(self) -> models.BatchClusterDocument:
        """The cluster for batches.

        Return the scheduler's address from the server's settings.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/batches/cluster"), models.BatchClusterDocument)

    def get(self, batch_id: str) -> models.BatchDocument:
        """One batch.

        Return how many products are made, and which failed with the reason.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/batches/{batch_id}", path_values={"batch_id": batch_id}),
            models.BatchDocument,
        )

    def remove(self, batch_id: str) -> None:
        """Remove a batch.

        Remove a batch with its products; the captures stay.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/batches/{batch_id}", path_values={"batch_id": batch_id})
        )

    def download(self, batch_id: str) -> Download:
        """The products as one ZIP file.

        Send the folder of the batch with unchanged files.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/batches/{batch_id}/download.zip", path_values={"batch_id": batch_id})
        )

    def overview(self, batch_id: str) -> Download:
        """A batch as one picture.

        Return a thumbnail for each capture, or the figures of an evaluation as bars.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/batches/{batch_id}/overview.png", path_values={"batch_id": batch_id})
        )


class CalibrationSessions:
    """Operations of `calibration_sessions`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.SessionDocument]:
        """All sessions, newest first.

        Return all sessions with their measurements.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/calibration_sessions"), builtins.list[models.SessionDocument]
        )

    def create(self, body: models.SessionRequest) -> models.SessionDocument:
        """Begin a session.

        Begin an empty session of this rig.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/calibration_sessions", body=body), models.SessionDocument
        )

    def combine(self, body: models.CombineRequest) -> models.SessionDocument:
        """Put sessions together.

        Begin a session with the sweeps of several and the newest lens; the step `fit` fits them
        jointly.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/calibration_sessions/combined", body=body), models.SessionDocument
        )

    def get(self, session_id: str) -> models.SessionDocument:
        """One session.

        Return one session.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/calibration_sessions/{session_id}", path_values={"session_id": session_id}),
            models.SessionDocument,
        )

    def remove(self, session_id: str) -> None:
        """Delete a session's measurements.

        Delete everything measured in a session; the calibrations fitted from it stay.

        Needs the right `administer`.
        """
        self._transport.order(
            Call(
                "DELETE", "/api/v1/calibration_sessions/{session_id}", path_values={"session_id": session_id}
            )
        )

    def remove_lens_sample(
        self, session_id: str, camera: Literal["left", "right"], sample_id: str
    ) -> models.SessionDocument:
        """Take a fovea's view of the board out of the fit.

        Remove one view of the board and fit the fovea's lens to the others.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "DELETE",
                "/api/v1/calibration_sessions/{session_id}/lenses/{camera}/samples/{sample_id}",
                path_values={"session_id": session_id, "camera": camera, "sample_id": sample_id},
            ),
            models.SessionDocument,
        )

    def lens_thumbnail(self, session_id: str, camera: Literal["left", "right"], sample_id: str) -> Download:
        """Thumbnail of a fovea's view of the board.

        Return a thumbnail of the fovea's picture, with the detected corners.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/calibration_sessions/{session_id}/lenses/{camera}/samples/{sample_id}.jpg",
                path_values={"session_id": session_id, "camera": camera, "sample_id": sample_id},
            )
        )

    def picture(self, session_id: str, name: str) -> Download:
        """A picture of the session's state.

        Return one picture, from the last run of its step.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/calibration_sessions/{session_id}/pictures/{name}.png",
                path_values={"session_id": session_id, "name": name},
            )
        )

    def run(
        self,
        session_id: str,
        body: models.WideRun
        | models.LensRun
        | models.MirrorsRun
        | models.FitRun
        | models.CheckRun
        | models.SettleRun
        | models.AllRun,
        *,
        idempotency_key: str | None = None,
    ) -> StartedJob[models.SessionDocument]:
        """Run a step.

        Queue a step as a job; run again, it adds measurements, or resumes where it was interrupted.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/calibration_sessions/{session_id}/runs",
                path_values={"session_id": session_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.SessionDocument,
        )

    def remove_sample(self, session_id: str, sample_id: str) -> models.SessionDocument:
        """Take a view of the board out of the fit.

        Remove one view of the board and fit the lens to the others.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "DELETE",
                "/api/v1/calibration_sessions/{session_id}/wide_samples/{sample_id}",
                path_values={"session_id": session_id, "sample_id": sample_id},
            ),
            models.SessionDocument,
        )

    def thumbnail(self, session_id: str, sample_id: str) -> Download:
        """Thumbnail of a view of the board.

        Return a thumbnail of the wide picture, with the detected corners.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/calibration_sessions/{session_id}/wide_samples/{sample_id}.jpg",
                path_values={"session_id": session_id, "sample_id": sample_id},
            )
        )


class Calibrations:
    """Operations of `calibrations`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(
        self, *, removed: Literal["true", "false"] | None = None
    ) -> builtins.list[models.CalibrationDocument]:
        """All calibrations of this rig, newest first.

        Return all calibrations known for this rig, or those that were discarded.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/calibrations", query={"removed": removed}),
            builtins.list[models.CalibrationDocument],
        )

    def compare(self, *, a: str, b: str) -> models.ComparisonDocument:
        """Compare two.

        Return the differences of calibration b from a, in pixels of the pictures.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/calibrations/compare", query={"a": a, "b": b}), models.ComparisonDocument
        )

    def compare_png(self, *, a: str, b: str) -> Download:
        """Compare two calibrations, as a picture.

        Return a picture of the differences of two calibrations over the field.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/calibrations/compare.png", query={"a": a, "b": b})
        )

    def current(self) -> models.CalibrationDocument:
        """Calibration in force.

        Return the calibration in force; 409 without one, 503 while the rig opens.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/calibrations/current"), models.CalibrationDocument)

    def health(self) -> models.HealthDocument:
        """Health of the calibration in force.

        Return the health of the calibration in force, from the residuals of ordinary fixations.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/calibrations/health"), models.HealthDocument)

    def import_file(self, body: JsonObject, *, distance_m: float | None = None) -> models.CalibrationDocument:
        """Import a calibration from a file.

        Store the calibration of a file of this program, or of the authors' device bundle. A bundle
        lacks the distance of its markers: give `distance_m`.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/calibrations/import", query={"distance_m": distance_m}, body=body),
            models.CalibrationDocument,
        )

    def get(self, calibration_id: str) -> models.CalibrationDocument:
        """One calibration.

        Return one calibration.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET", "/api/v1/calibrations/{calibration_id}", path_values={"calibration_id": calibration_id}
            ),
            models.CalibrationDocument,
        )

    def discard(self, calibration_id: str) -> None:
        """Discard a calibration.

        Move a calibration to the trash, from which it can be restored; not one in force or shipped.

        Needs the right `operate`.
        """
        self._transport.order(
            Call(
                "DELETE",
                "/api/v1/calibrations/{calibration_id}",
                path_values={"calibration_id": calibration_id},
            )
        )

    def activate(self, calibration_id: str) -> models.CalibrationDocument:
        """Put a calibration in force.

        Put a calibration in force, now and at every start of the server.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call(
                "POST",
                "/api/v1/calibrations/{calibration_id}/activate",
                path_values={"calibration_id": calibration_id},
            ),
            models.CalibrationDocument,
        )

    def download(
        self, calibration_id: str, *, format: Literal["foveacam", "authors"] | None = None
    ) -> JsonObject:
        """One as a file.

        Return the calibration as a file of this program, or with its poses as the authors' device
        bundle.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET",
                "/api/v1/calibrations/{calibration_id}/file",
                path_values={"calibration_id": calibration_id},
                query={"format": format},
            ),
            JsonObject,
        )

    def report(self, calibration_id: str) -> Download:
        """Report of a calibration, as a page.

        Return a self-contained HTML page: measured figures beside the paper's, and all pictures.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/calibrations/{calibration_id}/report",
                path_values={"calibration_id": calibration_id},
            )
        )

    def restore(self, calibration_id: str) -> models.CalibrationDocument:
        """Take a calibration out of the trash.

        Restore a calibration from the trash; the one in force stays in force.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "POST",
                "/api/v1/calibrations/{calibration_id}/restore",
                path_values={"calibration_id": calibration_id},
            ),
            models.CalibrationDocument,
        )


class CameraPresets:
    """Operations of `camera_presets`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.CameraPreset]:
        """Named settings of all cameras.

        Return all presets by their names.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/cameras/presets"), builtins.list[models.CameraPreset]
        )

    def save(self, name: str) -> models.CameraPreset:
        """Save the cameras' settings.

        Save the present settings of all connected cameras, replacing a preset of the same name.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/cameras/presets/{name}", path_values={"name": name}), models.CameraPreset
        )

    def delete(self, name: str) -> None:
        """Delete a preset.

        Delete a preset; the cameras stay as they are.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/cameras/presets/{name}", path_values={"name": name}))

    def apply(self, name: str) -> models.CameraPreset:
        """Apply saved settings.

        Give every connected camera of a preset its settings, now and at every start, or none.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/cameras/presets/{name}/apply", path_values={"name": name}),
            models.CameraPreset,
        )


class CameraSelfTests:
    """Operations of `camera_self_tests`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.TriggerTestDocument]:
        """All trigger tests, newest first.

        Return the results of all trigger tests.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/cameras/self_tests"), builtins.list[models.TriggerTestDocument]
        )

    def test_triggers(self, *, idempotency_key: str | None = None) -> StartedJob[models.TriggerTestDocument]:
        """Test both triggers.

        Queue a test of both eyes: a command to each, then one pulse to both; settings are restored.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/cameras/self_tests", idempotent=True, idempotency_key=idempotency_key),
            models.TriggerTestDocument,
        )

    def newest_test(self) -> models.TriggerTestDocument:
        """Newest trigger test.

        Return the newest trigger test; before the first both eyes are `untested`.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/cameras/self_tests/newest"), models.TriggerTestDocument
        )

    def get(self, test_id: str) -> models.TriggerTestDocument:
        """One trigger test.

        Return the result of one trigger test.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/cameras/self_tests/{test_id}", path_values={"test_id": test_id}),
            models.TriggerTestDocument,
        )


class Cameras:
    """Operations of `cameras`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.CameraDocument]:
        """All cameras.

        Return the last status of all cameras.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/cameras"), builtins.list[models.CameraDocument])

    def get(self, role: Literal["wide", "left", "right"]) -> models.CameraDocument:
        """One camera.

        Return the last status of one camera.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/cameras/{role}", path_values={"role": role}), models.CameraDocument
        )

    def change(
        self, role: Literal["wide", "left", "right"], body: models.CameraPatch
    ) -> models.CamerasChangedDocument:
        """Change a camera's settings.

        Change settings now and at every start; return what the camera accepted, or refuse with its
        range. `linked` changes both foveae, or neither. Hardware-triggered foveae have no automatic
        exposure; `once` with `linked` takes a few looks at the mirrors' present pose, and sets one
        exposure for both.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PATCH", "/api/v1/cameras/{role}", path_values={"role": role}, body=body),
            models.CamerasChangedDocument,
        )

    def reset(self, role: Literal["wide", "left", "right"]) -> models.CamerasChangedDocument:
        """Forget a camera's settings.

        Apply the rig file's settings, now and at every start.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("DELETE", "/api/v1/cameras/{role}/settings", path_values={"role": role}),
            models.CamerasChangedDocument,
        )


class Captures:
    """Operations of `captures`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(
        self, *, text: str | None = None, removed: Literal["true", "false"] | None = None
    ) -> builtins.list[models.CaptureDocument]:
        """Captures, newest first.

        Return all captures, or those that contain every word of `text`.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/captures", query={"text": text, "removed": removed}),
            builtins.list[models.CaptureDocument],
        )

    def create(
        self, body: models.CaptureRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.CaptureDocument]:
        """Capture a plan.

        Queue a capture as a job; an unusable name or plan or a full disk is refused before it starts.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/captures", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.CaptureDocument,
        )

    def estimate(self, body: models.EstimateRequest) -> models.EstimateDocument:
        """Estimate a plan.

        Return time, size, free disk space, warnings, and the outline of every view in the wide image.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/captures/estimates", body=body), models.EstimateDocument
        )

    def empty_trash(self) -> models.TrashEmptied:
        """Empty the trash.

        Delete the captures in the trash for good.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/captures/trash"), models.TrashEmptied)

    def get(self, capture_id: str) -> models.CaptureDocument:
        """One capture.

        Return one capture; while it runs, with its progress.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/captures/{capture_id}", path_values={"capture_id": capture_id}),
            models.CaptureDocument,
        )

    def patch(self, capture_id: str, body: models.CapturePatch) -> models.CaptureDocument:
        """Describe a capture.

        Change a capture's label or licence.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PATCH", "/api/v1/captures/{capture_id}", path_values={"capture_id": capture_id}, body=body),
            models.CaptureDocument,
        )

    def remove(self, capture_id: str) -> None:
        """Put a capture in the trash.

        Move a capture to the trash, from which it can be restored.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/captures/{capture_id}", path_values={"capture_id": capture_id})
        )

    def anaglyph(
        self, capture_id: str, index: int, form: Literal["jpg", "png"], *, bracket: str | None = None
    ) -> Download:
        """One point in red and cyan.

        Return both foveae of a point, rectified: left in red, right in green and blue.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/anaglyphs/{index}.{form}",
                path_values={"capture_id": capture_id, "index": index, "form": form},
                query={"bracket": bracket},
            )
        )

    def archive_capture(
        self, capture_id: str, body: models.ArchiveRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.CaptureDocument]:
        """Send a capture to the archive.

        Queue the upload as a job; files that the archive already has are not sent again.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/captures/{capture_id}/archive",
                path_values={"capture_id": capture_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.CaptureDocument,
        )

    def check_files(self, capture_id: str) -> models.CaptureChecked:
        """Verify the dataset's files.

        Read every file again and list the faults, as `foveacam dataset check` does: seconds per
        gigabyte.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/captures/{capture_id}/check", path_values={"capture_id": capture_id}),
            models.CaptureChecked,
        )

    def go_on(self, capture_id: str) -> models.CaptureDocument:
        """Continue a paused capture.

        Continue a paused capture; also confirms that the requested manual action is done.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/captures/{capture_id}/continue", path_values={"capture_id": capture_id}),
            models.CaptureDocument,
        )

    def download(self, capture_id: str) -> Download:
        """The dataset as one ZIP file.

        Send the dataset's folder with unchanged files.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/captures/{capture_id}/download.zip", path_values={"capture_id": capture_id})
        )

    def fetch_capture(
        self, capture_id: str, *, idempotency_key: str | None = None
    ) -> StartedJob[models.CaptureDocument]:
        """Fetch a capture from the archive.

        Queue the download of the files that are not on this machine, as a job.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/captures/{capture_id}/fetch",
                path_values={"capture_id": capture_id},
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.CaptureDocument,
        )

    def pause(self, capture_id: str) -> models.CaptureDocument:
        """Pause a running capture.

        Pause after the present point; the rig stays reserved for the capture.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/captures/{capture_id}/pause", path_values={"capture_id": capture_id}),
            models.CaptureDocument,
        )

    def points(self, capture_id: str) -> models.PointsDocument:
        """Its points.

        Return the captured points, with their places on the contact sheet, and the skipped ones.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/captures/{capture_id}/points", path_values={"capture_id": capture_id}),
            models.PointsDocument,
        )

    def picture(
        self,
        capture_id: str,
        index: int,
        role: Literal["left", "right", "wide"],
        form: Literal["jpg", "png"],
        *,
        bracket: str | None = None,
    ) -> Download:
        """Picture of one camera at a point.

        Return one picture at full size, 8 bits; the mean of a stack.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/points/{index}/{role}.{form}",
                path_values={"capture_id": capture_id, "index": index, "role": role, "form": form},
                query={"bracket": bracket},
            )
        )

    def restore(self, capture_id: str) -> models.CaptureDocument:
        """Restore a capture from the trash.

        Restore a capture from the trash.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/captures/{capture_id}/restore", path_values={"capture_id": capture_id}),
            models.CaptureDocument,
        )

    def resume(
        self, capture_id: str, *, idempotency_key: str | None = None
    ) -> StartedJob[models.CaptureDocument]:
        """Resume a partial capture.

        Queue the rest of a capture, from exactly the next point, with its own plan and calibration.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/captures/{capture_id}/resume",
                path_values={"capture_id": capture_id},
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.CaptureDocument,
        )

    def picture_of(
        self, capture_id: str, picture: Literal["thumbnail", "sheet", "coverage"], form: Literal["jpg", "png"]
    ) -> Download:
        """Thumbnail, contact sheet or coverage.

        Draw the capture's points so far.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/{picture}.{form}",
                path_values={"capture_id": capture_id, "picture": picture, "form": form},
            )
        )


class Clouds:
    """Operations of `clouds`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self, *, limit: int | None = None) -> builtins.list[models.CloudDocument]:
        """Newest clouds, newest first.

        Return the newest clouds.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/clouds", query={"limit": limit}), builtins.list[models.CloudDocument]
        )

    def get(self, cloud_id: str) -> models.CloudDocument:
        """One cloud.

        Return one cloud.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/clouds/{cloud_id}", path_values={"cloud_id": cloud_id}), models.CloudDocument
        )

    def remove(self, cloud_id: str) -> None:
        """Remove a cloud.

        Remove a cloud and its files; fixation and target stay, with an earlier cloud if there is one.

        Needs the right `administer`.
        """
        self._transport.order(Call("DELETE", "/api/v1/clouds/{cloud_id}", path_values={"cloud_id": cloud_id}))

    def glb(self, cloud_id: str) -> Download:
        """Textured surface as GLB.

        Return the textured mesh, in metres, +y up.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/clouds/{cloud_id}.glb", path_values={"cloud_id": cloud_id})
        )

    def ply(self, cloud_id: str) -> Download:
        """Points as PLY.

        Return x, y, z (m, rig frame), colour and sigma of every point.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/clouds/{cloud_id}.ply", path_values={"cloud_id": cloud_id})
        )

    def depth_png(self, cloud_id: str) -> Download:
        """Depth as a picture.

        Return depth as colours with a scale.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/clouds/{cloud_id}/depth.png", path_values={"cloud_id": cloud_id})
        )


class Depth:
    """Operations of `depth`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self, *, x_px: float, y_px: float) -> models.DepthDocument:
        """Depth at a wide pixel.

        Return distance and point at a wide pixel that a fovea has looked at.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/depth", query={"x_px": x_px, "y_px": y_px}), models.DepthDocument
        )

    def choose(self, body: models.DepthBackendChoice) -> models.DepthBackendsDocument:
        """Choose the backend of looks.

        Use a backend for all looks from now on; it is kept over a restart.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/depth/backend", body=body), models.DepthBackendsDocument
        )

    def backends(self) -> models.DepthBackendsDocument:
        """Backends that compute the depth of looks.

        Return all backends, the one in use, and why the last look fell back to semi-global matching.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/depth/backends"), models.DepthBackendsDocument)

    def check(self, name: str) -> models.NetworkCheckDocument:
        """Check a network.

        Run a network on a pair with known disparities; report faults of the network or its card.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/depth/backends/{name}/check", path_values={"name": name}),
            models.NetworkCheckDocument,
        )

    def compare(self, body: models.BackendComparisonRequest) -> models.BackendComparisonDocument:
        """Compare two backends on the newest look.

        Compute the depth of the newest look by two backends; return their differences, with pictures.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/depth/comparisons", body=body), models.BackendComparisonDocument
        )

    def picture(
        self, comparison_id: str, picture: Literal["first", "second", "difference", "left"]
    ) -> Download:
        """Picture of a comparison.

        Return either backend's depth, their difference, or the left picture; the last comparisons are
        held.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/depth/comparisons/{comparison_id}/{picture}.png",
                path_values={"comparison_id": comparison_id, "picture": picture},
            )
        )


class DisplayPattern:
    """Operations of `display_pattern`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.PatternDocument:
        """The pattern of the displays.

        Return the pattern that all screens show.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/displays/pattern"), models.PatternDocument)

    def show(
        self,
        body: models.CharucoPattern
        | models.CheckerboardPattern
        | models.MarkerPattern
        | models.MarkersPattern
        | models.BlankPattern,
    ) -> models.PatternDocument:
        """Show a pattern.

        Show a pattern at its true size on all screens, now and after a restart.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/displays/pattern", body=body), models.PatternDocument
        )

    def pdf(
        self,
        *,
        kind: Literal["charuco", "checkerboard", "marker", "markers"] | None = None,
        columns: int | None = None,
        rows: int | None = None,
        square_mm: float | None = None,
        marker_mm: float | None = None,
        dictionary: Literal[
            "4X4_50",
            "4X4_100",
            "4X4_250",
            "4X4_1000",
            "5X5_50",
            "5X5_100",
            "5X5_250",
            "5X5_1000",
            "6X6_50",
            "6X6_100",
            "6X6_250",
            "6X6_1000",
            "7X7_50",
            "7X7_100",
            "7X7_250",
            "7X7_1000",
        ]
        | None = None,
        id: int | None = None,
        side_mm: float | None = None,
        spacing_mm: float | None = None,
        paper: Literal["A4", "A3", "Letter"] | None = None,
        margin_mm: float | None = None,
    ) -> Download:
        """A pattern as PDF.

        Return the pattern of the query (without `kind`, that of the displays), to be printed at 100 %.
        A pattern larger than the paper is split over up to nine sheets, with crop marks.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/displays/pattern.pdf",
                query={
                    "kind": kind,
                    "columns": columns,
                    "rows": rows,
                    "square_mm": square_mm,
                    "marker_mm": marker_mm,
                    "dictionary": dictionary,
                    "id": id,
                    "side_mm": side_mm,
                    "spacing_mm": spacing_mm,
                    "paper": paper,
                    "margin_mm": margin_mm,
                },
            )
        )

    def svg(self) -> Download:
        """The pattern as SVG.

        Return the pattern at its true size in millimetres, for screens and printers.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/displays/pattern.svg"))


class Displays:
    """Operations of `displays`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.DisplayDocument]:
        """Connected displays.

        Return the screens that show the pattern; a screen silent for 15 s is left out.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/displays"), builtins.list[models.DisplayDocument])

    def register(self, display_id: str, body: models.DisplayRequest) -> models.PatternDocument:
        """Register a display.

        Register a screen or renew its registration, to be repeated within 15 s; return its pattern.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/displays/{display_id}", path_values={"display_id": display_id}, body=body),
            models.PatternDocument,
        )

    def forget(self, display_id: str) -> None:
        """Remove a display from the list.

        Remove a screen that no longer shows the pattern from the list.

        Needs the right `view`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/displays/{display_id}", path_values={"display_id": display_id})
        )


class DriftChecks:
    """Operations of `drift_checks`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.DriftCheckDocument]:
        """All drift checks, newest first.

        Return the results of all checks.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/drift_checks"), builtins.list[models.DriftCheckDocument]
        )

    def create(
        self, body: models.DriftRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.DriftCheckDocument]:
        """Check the drift.

        Queue a check; with `apply`, a significant drift is corrected and the result put in force.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/drift_checks", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.DriftCheckDocument,
        )

    def trend(self) -> Download:
        """Drift over time.

        Return a picture of both eyes' drift over time.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/drift_checks/trend.png"))

    def get(self, check_id: str) -> models.DriftCheckDocument:
        """One check.

        Return the result of one check.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/drift_checks/{check_id}", path_values={"check_id": check_id}),
            models.DriftCheckDocument,
        )


class Engine:
    """Operations of `engine`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.EngineDocument:
        """Load, rates, gaps and drops of the server's parts.

        Return the load of each thread, queue, stage, camera and view now, and the times of the start.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/engine"), models.EngineDocument)


class Events:
    """Operations of `events`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def stream(self, *, last_event_id: int | None = None) -> Generator[models.EventDocument, None]:
        """Live events.

        Stream events as they come; with `Last-Event-ID`, first those after it.

        Needs the right `view`.
        """
        return self._transport.events(Call("GET", "/api/v1/events"), last_event_id=last_event_id)

    def recent(self, *, limit: int | None = None) -> builtins.list[models.EventDocument]:
        """The newest events, oldest first.

        Return the newest events.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/events/recent", query={"limit": limit}), builtins.list[models.EventDocument]
        )


class Exports:
    """Operations of `exports`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self, capture_id: str) -> models.DatasetExports:
        """A capture's exports.

        Return for each format the finished export, the progress of its job, or why none is possible.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/captures/{capture_id}/exports", path_values={"capture_id": capture_id}),
            models.DatasetExports,
        )

    def make(
        self, capture_id: str, body: models.DatasetExportRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.DatasetExport]:
        """Export a capture.

        Queue an export as a job without the rig; refuse an impossible one, and one that might not fit.
        Where the same export of the unchanged dataset exists, the job ends at once with it.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/captures/{capture_id}/exports",
                path_values={"capture_id": capture_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.DatasetExport,
        )

    def get(
        self, capture_id: str, kind: Literal["hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors"]
    ) -> models.DatasetExport:
        """One of a capture's exports.

        Return the export to one format, the progress of its job, or why none is possible.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/exports/{kind}",
                path_values={"capture_id": capture_id, "kind": kind},
            ),
            models.DatasetExport,
        )

    def remove(
        self, capture_id: str, kind: Literal["hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors"]
    ) -> None:
        """Remove a capture's export.

        Remove one export; the capture and its other exports stay.

        Needs the right `operate`.
        """
        self._transport.order(
            Call(
                "DELETE",
                "/api/v1/captures/{capture_id}/exports/{kind}",
                path_values={"capture_id": capture_id, "kind": kind},
            )
        )

    def download(
        self, capture_id: str, kind: Literal["hugging-face", "colmap", "nerfstudio", "ome-zarr", "authors"]
    ) -> Download:
        """Download an export.

        Send a finished export as one ZIP file, also by ranges.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/exports/{kind}.zip",
                path_values={"capture_id": capture_id, "kind": kind},
            )
        )


class Faults:
    """Operations of `faults`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.FaultDocument]:
        """Faults and warnings since the start.

        Return at most 50 faults without the dismissed ones; errors first, each level newest first.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/faults"), builtins.list[models.FaultDocument])

    def dismiss_over(self) -> models.FaultsDismissed:
        """Dismiss all faults that are over.

        Remove all faults that are over from the list, for everybody; one that recurs is listed again.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/faults"), models.FaultsDismissed)

    def dismiss(self, fault_id: str) -> None:
        """Dismiss a fault.

        Remove a fault from the list, for everybody; it is listed again when it recurs.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/faults/{fault_id}", path_values={"fault_id": fault_id}))


class Fixations:
    """Operations of `fixations`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self, *, limit: int | None = None) -> builtins.list[models.FixationDocument]:
        """Newest fixations, newest first.

        Return the newest fixations.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/fixations", query={"limit": limit}), builtins.list[models.FixationDocument]
        )

    def create(
        self, body: models.FixationRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.FixationDocument]:
        """Look there.

        Queue a fixation as a job; `Prefer: wait=10` answers with the fixation itself when it ends in
        time.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/fixations", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.FixationDocument,
        )

    def estimates(self) -> builtins.list[models.FixationEstimate]:
        """Estimates of the running fixations.

        Return the newest estimate of each running fixation; its distance is null while nothing is
        known.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/fixations/estimates"), builtins.list[models.FixationEstimate]
        )

    def get(self, fixation_id: str) -> models.FixationDocument:
        """One fixation.

        Return one fixation with all its steps.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/fixations/{fixation_id}", path_values={"fixation_id": fixation_id}),
            models.FixationDocument,
        )

    def choice(self, fixation_id: str, body: models.ChoiceRequest) -> models.FixationDocument:
        """Choose one of the alternatives.

        Make one alternative the answer of the fixation's target; nothing moves.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "POST",
                "/api/v1/fixations/{fixation_id}/choice",
                path_values={"fixation_id": fixation_id},
                body=body,
            ),
            models.FixationDocument,
        )

    def correct(
        self, fixation_id: str, body: models.CorrectionRequest
    ) -> StartedJob[models.FixationDocument]:
        """Look again nearer or farther.

        Queue a look at the same target that takes only distances nearer or farther than its answer.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/fixations/{fixation_id}/corrections",
                path_values={"fixation_id": fixation_id},
                body=body,
            ),
            models.FixationDocument,
        )

    def estimate(self, fixation_id: str) -> models.FixationEstimate:
        """Newest estimate of a fixation.

        Return the newest estimate of a running fixation, or the answer of one that has ended.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/fixations/{fixation_id}/estimate", path_values={"fixation_id": fixation_id}),
            models.FixationEstimate,
        )

    def look_at_full_resolution(
        self, fixation_id: str, *, idempotency_key: str | None = None
    ) -> StartedJob[models.CloudDocument]:
        """Look once more, at full resolution.

        Queue one look of both foveae at the answer's point at binning 1; its result is the new cloud.
        Distance and target stay; cloud and depth map are replaced by those of this look, with four
        times as many points.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/fixations/{fixation_id}/full_resolution",
                path_values={"fixation_id": fixation_id},
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.CloudDocument,
        )


class Follows:
    """Operations of `follows`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.FollowedDocument]:
        """All followed targets.

        Return the followed targets as they are now, oldest first.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/follows"), builtins.list[models.FollowedDocument])

    def create(self, body: models.FollowRequest) -> models.FollowedDocument:
        """Follow a target.

        Follow a further target, 8 at most: both foveae verge on it, then look at all targets in turn.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/follows", body=body), models.FollowedDocument)

    def end_all(self) -> None:
        """Stop following all targets.

        Stop following all targets; the mirrors stay where they are.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/follows"))

    def take_round(
        self, body: models.FollowRoundRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.FollowRoundTaken]:
        """Capture all followed targets.

        Look once at each followed target and keep the pictures with their poses as a dataset, as a job.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST", "/api/v1/follows/rounds", body=body, idempotent=True, idempotency_key=idempotency_key
            ),
            models.FollowRoundTaken,
        )

    def get(self, follow_id: str) -> models.FollowedDocument:
        """One followed target.

        Return a followed target as it is now.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/follows/{follow_id}", path_values={"follow_id": follow_id}),
            models.FollowedDocument,
        )

    def change(self, follow_id: str, body: models.FollowPatch) -> models.FollowedDocument:
        """Change how a target is followed.

        Change label, tracker or priority while it is followed.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PATCH", "/api/v1/follows/{follow_id}", path_values={"follow_id": follow_id}, body=body),
            models.FollowedDocument,
        )

    def end(self, follow_id: str) -> None:
        """Stop following one.

        Stop following a target.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/follows/{follow_id}", path_values={"follow_id": follow_id})
        )

    def trail(self, follow_id: str) -> builtins.list[models.TrailPoint]:
        """Where a followed target was.

        Return its last hits, 600 at most, oldest first.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/follows/{follow_id}/trail", path_values={"follow_id": follow_id}),
            builtins.list[models.TrailPoint],
        )


class Health:
    """Operations of `health`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def healthz(self) -> models.Liveness:
        """Is the process alive?.

        Answer in any state of the rig.
        """
        return self._transport.answer(Call("GET", "/healthz"), models.Liveness)

    def metrics(self) -> Download:
        """Counters for Prometheus.

        Return the counters in Prometheus' text format.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/metrics"))

    def readyz(self) -> models.Readiness:
        """Can it foveate now?.

        Return 200 when a fixation could start now, else 503 and what is missing.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/readyz", also=(503,)), models.Readiness)


class Jobs:
    """Operations of `jobs`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self, *, limit: int | None = None) -> builtins.list[models.JobDocument]:
        """Newest jobs, newest first.

        Return the newest jobs.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/jobs", query={"limit": limit}), builtins.list[models.JobDocument]
        )

    def get(self, job_id: str) -> models.JobDocument:
        """One job.

        Return one job in its present state.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/jobs/{job_id}", path_values={"job_id": job_id}), models.JobDocument
        )

    def cancel(self, job_id: str) -> models.JobDocument:
        """Cancel a job.

        Cancel a job at its next step, unless it has ended.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/jobs/{job_id}/cancel", path_values={"job_id": job_id}), models.JobDocument
        )


class Lease:
    """Operations of `lease`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.LeaseDocument:
        """Holder of the lease.

        Return the holder of the lease; null: nobody, and anybody may move the rig.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/lease"), models.LeaseDocument)

    def take(self, body: models.LeaseRequest) -> models.LeaseGrant:
        """Take the lease.

        Take the lease, from another holder only with `take_over`; keep it with PUT at least every 15 s.
        Where people sign in, only an admin can take it over from another person, with a reason.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/lease", body=body), models.LeaseGrant)

    def renew(self) -> models.LeaseGrant:
        """Keep the lease.

        Renew the lease that the X-Lease header names.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("PUT", "/api/v1/lease"), models.LeaseGrant)

    def release(self) -> None:
        """Release the lease.

        Release the lease.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/lease"))


class LeaseWishes:
    """Operations of `lease_wishes`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def ask(self, body: models.LeaseWish) -> models.LeaseDocument:
        """Request the lease.

        Request the lease from its holder; when it is handed over, take it with POST within 20 s.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/lease/request", body=body), models.LeaseDocument)

    def answer(self, body: models.LeaseAnswer) -> models.LeaseDocument:
        """Answer a request for the lease.

        Hand the lease over to the client that requests it, or keep it.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("PUT", "/api/v1/lease/request", body=body), models.LeaseDocument)


class Loop:
    """Operations of `loop`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.LoopDocument:
        """The vergence loop.

        Return the present state of the loop: status, errors, commands, distance, trigger and settings.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/loop"), models.LoopDocument)

    def look_at(self, body: models.LoopTargetRequest) -> models.LoopDocument:
        """Keep both foveae on a target.

        Choose the target; starts the loop if it does not run. The loop yields the rig to other jobs.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/loop", body=body), models.LoopDocument)

    def change(self, body: models.LoopPatch) -> models.LoopDocument:
        """Pause the loop, hold or set its axes.

        Pause or resume; hold single axes; set the command of an axis, which holds it from then on.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("PATCH", "/api/v1/loop", body=body), models.LoopDocument)

    def end(self) -> None:
        """End the loop.

        End the loop; the mirrors stay where they are.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/loop"))

    def drag(self, body: models.LoopDrag) -> None:
        """Steer both eyes by hand.

        Point both eyes in parallel at a place of the wide view, without corrections, until released.

        Needs the right `operate`.
        """
        self._transport.order(Call("PUT", "/api/v1/loop/drag", body=body))

    def release(self) -> None:
        """Release the eyes.

        Release the eyes; the loop resumes with its target.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/loop/drag"))

    def reunite(self) -> models.LoopDocument:
        """End the split of the eyes.

        End the split of the eyes; without a common target the loop ends.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/loop/eyes"), models.LoopDocument)

    def follow_apart(self, eye: Literal["left", "right"], body: models.LoopEyePlace) -> models.LoopDocument:
        """Let one eye follow a separate place.

        Keep a place of one fovea's picture centred; the other eye keeps its own place, or rests.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/loop/eyes/{eye}", path_values={"eye": eye}, body=body), models.LoopDocument
        )

    def history(self, *, after_look: int | None = None) -> builtins.list[models.LoopSample]:
        """The loop's last looks.

        Return the looks after a given one, oldest first, 900 at most.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/loop/history", query={"after_look": after_look}),
            builtins.list[models.LoopSample],
        )

    def match_png(self) -> Download:
        """Match of the last look.

        Return the guide strip with both eyes' boxes, and each eye's correlation map, as a PNG.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/loop/match.png"))

    def reset_trigger(self) -> models.LoopDocument:
        """Reset the trigger.

        Reset the trigger, so that the loop resumes after repeated equal failures have latched it.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/loop/trigger/reset"), models.LoopDocument)

    def tune(
        self, body: models.LoopTuneRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.LoopDocument]:
        """Tune the gains.

        Tune the gains on the target by relays, then by CMA-ES if requested, as a job. When cancelled or
        refused, the gains stay as they were.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/loop/tune", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.LoopDocument,
        )

    def tune_png(self) -> Download:
        """Step responses before and after tuning.

        Return the step responses before and after the last tuning, as a PNG.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/loop/tune.png"))

    def tune_svg(self) -> Download:
        """Step responses before and after tuning, as SVG.

        Return the step responses before and after the last tuning, as an SVG.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/loop/tune.svg"))


class LoopSettings:
    """Operations of `loop_settings`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def change_settings(self, body: models.LoopSettingsPatch) -> models.LoopSettingsDocument:
        """Change settings of the loop.

        Change settings now and for later runs; fields left out stay.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PATCH", "/api/v1/loop/settings", body=body), models.LoopSettingsDocument
        )

    def reset_settings(
        self,
        *,
        group: Literal["pan", "depth", "vertical", "match", "timing", "tracker", "prediction"] | None = None,
    ) -> models.LoopSettingsDocument:
        """Put settings back to their defaults.

        Put one group of settings, or all, back to their defaults.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("DELETE", "/api/v1/loop/settings", query={"group": group}), models.LoopSettingsDocument
        )


class Measurements:
    """Operations of `measurements`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.MeasurementDocument]:
        """All measurements, newest first.

        Return all measurements.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/measurements"), builtins.list[models.MeasurementDocument]
        )

    def create(self, body: models.MeasurementRequest) -> models.MeasurementDocument:
        """Measure.

        Measure a point, a length, a plane or a profile at pixels of views, and store it.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/measurements", body=body), models.MeasurementDocument
        )

    def as_csv(self) -> Download:
        """All measurements as CSV.

        Return one line per measurement, newest first; samples of profiles are in the JSON export only.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/measurements.csv"))

    def as_json(self) -> builtins.list[models.MeasurementDocument]:
        """All measurements as a JSON file.

        Return all measurements, to be saved as a file.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/measurements.json"), builtins.list[models.MeasurementDocument]
        )

    def get(self, measurement_id: str) -> models.MeasurementDocument:
        """One measurement.

        Return one measurement.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET", "/api/v1/measurements/{measurement_id}", path_values={"measurement_id": measurement_id}
            ),
            models.MeasurementDocument,
        )

    def rename(self, measurement_id: str, body: models.MeasurementPatch) -> models.MeasurementDocument:
        """Rename a measurement.

        Give a measurement another label.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "PATCH",
                "/api/v1/measurements/{measurement_id}",
                path_values={"measurement_id": measurement_id},
                body=body,
            ),
            models.MeasurementDocument,
        )

    def remove(self, measurement_id: str) -> None:
        """Remove a measurement.

        Remove a measurement; the look that it was made in stays.

        Needs the right `operate`.
        """
        self._transport.order(
            Call(
                "DELETE",
                "/api/v1/measurements/{measurement_id}",
                path_values={"measurement_id": measurement_id},
            )
        )


class Mirrors:
    """Operations of `mirrors`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.MirrorsDocument:
        """Both mirrors.

        Return the last status of both mirrors.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/mirrors"), models.MirrorsDocument)

    def disable(self) -> models.MirrorsDocument:
        """Switch the mirrors off.

        Park both mirrors and switch their supply rail off, until it is switched on again.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/mirrors/disable"), models.MirrorsDocument)

    def enable(self) -> models.MirrorsDocument:
        """Switch the mirrors on.

        Switch the mirrors' supply rail on, both at rest, if it is off.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/mirrors/enable"), models.MirrorsDocument)

    def park(self) -> models.MirrorsDocument:
        """Bring both mirrors to rest.

        Set both mirrors to zero volts; unlike the stop it lets the next move pass.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/mirrors/park"), models.MirrorsDocument)

    def recover(self) -> models.MirrorsDocument:
        """Restart the mirrors' DACs.

        Recover a frozen mirror without switching the rail: restart both DACs, then restore the targets.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/mirrors/recover"), models.MirrorsDocument)

    def steer(self, body: models.SteerRequest) -> models.MirrorsDocument:
        """Point both foveae, open loop.

        Point both eyes at a direction and distance from the rig's origin; in parallel without a
        distance.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/mirrors/steer", body=body), models.MirrorsDocument
        )

    def set_volts(self, body: models.VoltsRequest) -> models.MirrorsDocument:
        """Set the mirrors' volts.

        Set the differential volts of one eye or both, calibrated or not.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("PUT", "/api/v1/mirrors/volts", body=body), models.MirrorsDocument)


class Mosaics:
    """Operations of `mosaics`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self, capture_id: str) -> models.MosaicDocument:
        """A capture's mosaic.

        Return the mosaic's state, its job's progress, and its estimated size or why none is possible.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/captures/{capture_id}/mosaic", path_values={"capture_id": capture_id}),
            models.MosaicDocument,
        )

    def make(
        self, capture_id: str, body: models.MosaicRequest | None = None, *, idempotency_key: str | None = None
    ) -> StartedJob[models.MosaicDocument]:
        """Make a capture's mosaic.

        Queue a mosaic, or the rest of an unfinished one, as a job without the rig; refuse an impossible
        one. An older mosaic of the capture stays until the new one is finished.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/captures/{capture_id}/mosaic",
                path_values={"capture_id": capture_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.MosaicDocument,
        )

    def remove(self, capture_id: str) -> None:
        """Remove a capture's mosaic.

        Remove the files of the mosaic, also of an unfinished one; the capture stays.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/captures/{capture_id}/mosaic", path_values={"capture_id": capture_id})
        )

    def ply(self, capture_id: str, *, made: str | None = None) -> Download:
        """The points as PLY.

        Return x, y, z (m, rig frame), colour and sigma of every point.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/mosaic/cloud.ply",
                path_values={"capture_id": capture_id},
                query={"made": made},
            )
        )

    def show(self, capture_id: str) -> models.MosaicDocument:
        """Show the mosaic in 3D.

        Show the mosaic's surface in the 3D scene, replacing another mosaic's.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "PUT", "/api/v1/captures/{capture_id}/mosaic/in_scene", path_values={"capture_id": capture_id}
            ),
            models.MosaicDocument,
        )

    def hide(self, capture_id: str) -> models.MosaicDocument:
        """Take the mosaic out of the 3D scene.

        Remove the mosaic's surface from the 3D scene, if it is there.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "DELETE",
                "/api/v1/captures/{capture_id}/mosaic/in_scene",
                path_values={"capture_id": capture_id},
            ),
            models.MosaicDocument,
        )

    def glb(self, capture_id: str, *, made: str | None = None) -> Download:
        """The surface as GLB.

        Return the textured surface of the whole field, in metres, +y up.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/mosaic/mesh.glb",
                path_values={"capture_id": capture_id},
                query={"made": made},
            )
        )

    def descriptor(self, capture_id: str, layer: Literal["picture", "depth"]) -> Download:
        """A layer as Deep Zoom.

        Return the Deep Zoom descriptor; its tiles are beside it, as Deep Zoom requires.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/mosaic/tiles/{layer}.dzi",
                path_values={"capture_id": capture_id, "layer": layer},
            )
        )

    def tile(
        self,
        capture_id: str,
        layer: Literal["picture", "depth"],
        level: int,
        x: int,
        y: int,
        form: Literal["jpg", "png"],
        *,
        made: str | None = None,
    ) -> Download:
        """One tile.

        Return one tile: JPEG of the picture, PNG of the depth.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/mosaic/tiles/{layer}_files/{level}/{x}_{y}.{form}",
                path_values={
                    "capture_id": capture_id,
                    "layer": layer,
                    "level": level,
                    "x": x,
                    "y": y,
                    "form": form,
                },
                query={"made": made},
            )
        )

    def picture_of(
        self, capture_id: str, picture: Literal["overview", "depth"], *, made: str | None = None
    ) -> Download:
        """Overview, or depth as colours.

        Return the whole picture at 2048 px at most, or the heat map of depth with its scale.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/mosaic/{picture}.png",
                path_values={"capture_id": capture_id, "picture": picture},
                query={"made": made},
            )
        )


class PanTilt:
    """Operations of `pan_tilt`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.PanTiltDocument:
        """Where the rig points.

        Return the pan-tilt's present pose, its limits and the rig's stations.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/pan_tilt"), models.PanTiltDocument)

    def hold(self) -> models.PanTiltDocument:
        """Stop turning now.

        Stop the pan-tilt where it is; needs no lease.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/pan_tilt/holds"), models.PanTiltDocument)

    def home(self) -> models.PanTiltDocument:
        """Find the reference switches.

        Start homing: search the reference switches; it clears an alarm.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/pan_tilt/homings"), models.PanTiltDocument)

    def move(self, body: models.PanTiltMove) -> models.PanTiltDocument:
        """Turn the rig.

        Start to turn the rig to a station or a bearing; returns before it arrives.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/pan_tilt/moves", body=body), models.PanTiltDocument
        )

    def confirm_zero(self) -> models.PanTiltDocument:
        """Confirm its zero position.

        Take the present pose as the zero on the operator's confirmation, without reference switches. It
        clears the fault of a board that has restarted; on a shared board it applies to every axis.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/pan_tilt/zero_confirmations"), models.PanTiltDocument
        )


class Planner:
    """Operations of `planner`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def make_map(
        self,
        body: models.OpenMapRequest
        | models.RandomMapRequest
        | models.GeojsonMapRequest
        | models.PictureMapRequest,
    ) -> models.MapDocument:
        """A map, random, of GeoJSON or of a picture.

        Return a map in metres: random, without obstacles, or the sent one after a check.

        Needs the right `view`.
        """
        return self._transport.answer(Call("POST", "/api/v1/planner/map", body=body), models.MapDocument)

    def regions(self, body: models.RegionsRequest) -> models.RegionsDocument:
        """Where to stand on a map.

        Return the regions from which each target is seen unnoticed: in its ring, in sight,
        unobstructed.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/planner/regions", body=body), models.RegionsDocument
        )

    def standoff(self, body: models.StandoffRequest) -> models.StandoffDocument:
        """Where to stand about one target.

        Return the ring, and the probability of success among random obstacles with its curve (Eqs.
        6-13).

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/planner/standoff", body=body), models.StandoffDocument
        )


class Rail:
    """Operations of `rail`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.RailDocument:
        """Position of the rig on its rail.

        Return the rail's present position, its limits and its named places.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rail"), models.RailDocument)

    def hold(self) -> models.RailDocument:
        """Stop moving sideways now.

        Stop the rail where it is; needs no lease.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/rail/holds"), models.RailDocument)

    def home(self) -> models.RailDocument:
        """Find the reference switch.

        Start homing: search the reference switch; on a shared board the pan-tilt homes, too.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/rail/homings"), models.RailDocument)

    def move(self, body: models.RailMove) -> models.RailDocument:
        """Move the rig sideways.

        Start to move the rig to a named place or a position; returns before it arrives.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/rail/moves", body=body), models.RailDocument)

    def confirm_zero(self) -> models.RailDocument:
        """Confirm its zero position.

        Take the present position as the zero on the operator's confirmation, without reference
        switches. It clears the fault of a board that has restarted; on a shared board it applies to
        every axis.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/rail/zero_confirmations"), models.RailDocument)


class Reach:
    """Operations of `reach`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self, *, distance_m: float | None = None) -> models.ReachDocument:
        """Where each eye can look.

        Return the outline of each eye's calibrated field in the wide image.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/reach", query={"distance_m": distance_m}), models.ReachDocument
        )


class RecordingUploads:
    """Operations of `recording_uploads`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def begin_upload(self, body: models.UploadRequest) -> models.UploadDocument:
        """Begin to send a recording of at most 256 GiB.

        Begin an upload; refused at once where the name is used, or the disk lacks space.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/recordings/uploads", body=body), models.UploadDocument
        )

    def get(self, upload_id: str) -> models.UploadDocument:
        """Progress of an upload.

        Return an upload, to resume it after a lost connection.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/recordings/uploads/{upload_id}", path_values={"upload_id": upload_id}),
            models.UploadDocument,
        )

    def add_part(self, upload_id: str, content: bytes, *, at: int) -> models.UploadDocument:
        """Send a part of a recording.

        Append a part of at most 8 MiB; after the last one the file is checked and added.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "PUT",
                "/api/v1/recordings/uploads/{upload_id}",
                path_values={"upload_id": upload_id},
                query={"at": at},
                content=content,
            ),
            models.UploadDocument,
        )

    def abandon(self, upload_id: str) -> None:
        """Abandon an upload.

        Cancel an upload and delete its received parts.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/recordings/uploads/{upload_id}", path_values={"upload_id": upload_id})
        )


class Recordings:
    """Operations of `recordings`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(
        self, *, text: str | None = None, removed: Literal["true", "false"] | None = None
    ) -> builtins.list[models.RecordingDocument]:
        """Recordings, newest first.

        Return all recordings, or those that contain every word of `text`.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/recordings", query={"text": text, "removed": removed}),
            builtins.list[models.RecordingDocument],
        )

    def create(
        self, body: models.RecordingRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.RecordingDocument]:
        """Record what the cameras deliver.

        Begin a recording as a job. It does not move or reserve the rig: other work goes on, and is
        recorded.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/recordings", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.RecordingDocument,
        )

    def folders(self) -> models.FoldersDocument:
        """Recordings in folders of the server's machine.

        List what can be opened in the data directory's `import` and in FOVEACAM_RECORDING_FOLDERS.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/recordings/folders"), models.FoldersDocument)

    def formats(self) -> builtins.list[models.FormatDocument]:
        """Formats of exports.

        Return every format, and whether this machine can write it.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/recordings/formats"), builtins.list[models.FormatDocument]
        )

    def name(
        self, *, name: str | None = None, numbered: Literal["true", "false"] | None = None
    ) -> models.NameDocument:
        """The name that a recording would get.

        Return the name with its number, and whether a recording of that name can be made now.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/recordings/name", query={"name": name, "numbered": numbered}),
            models.NameDocument,
        )

    def open_file(self, body: models.OpenRequest) -> models.RecordingDocument:
        """Open a recording in place.

        Add a recording from one of the folders; its file stays there and is only read.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/recordings/open", body=body), models.RecordingDocument
        )

    def empty_trash(self) -> models.TrashEmptied:
        """Empty the trash.

        Delete the recordings in the trash for good, with their films.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/recordings/trash"), models.TrashEmptied)

    def get(self, recording_id: str) -> models.RecordingDocument:
        """One recording.

        Return one recording; in progress, with its counts so far.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/recordings/{recording_id}", path_values={"recording_id": recording_id}),
            models.RecordingDocument,
        )

    def patch(self, recording_id: str, body: models.RecordingPatch) -> models.RecordingDocument:
        """Describe a recording.

        Change a recording's label.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "PATCH",
                "/api/v1/recordings/{recording_id}",
                path_values={"recording_id": recording_id},
                body=body,
            ),
            models.RecordingDocument,
        )

    def remove(self, recording_id: str) -> None:
        """Put a recording in the trash.

        Move a recording to the trash, from which it can be restored.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/recordings/{recording_id}", path_values={"recording_id": recording_id})
        )

    def anaglyph(
        self,
        recording_id: str,
        *,
        t_s: float | None = None,
        style: Literal["red_cyan", "red_blue", "cyan_red", "blue_red"] | None = None,
    ) -> Download:
        """Both foveae of a moment in red and cyan.

        Return both foveae as an anaglyph, rectified where poses and calibration were recorded.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/anaglyph.jpg",
                path_values={"recording_id": recording_id},
                query={"t_s": t_s, "style": style},
            )
        )

    def archive_recording(
        self, recording_id: str, body: models.ArchiveRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.RecordingDocument]:
        """Send a recording to the archive.

        Queue the upload as a job; files that the archive already has are not sent again.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/recordings/{recording_id}/archive",
                path_values={"recording_id": recording_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.RecordingDocument,
        )

    def depth(
        self,
        recording_id: str,
        *,
        t_s: float | None = None,
        backend: str | None = None,
        looks: int | None = None,
        research_confirmed: bool | None = None,
    ) -> models.RecordedDepthDocument:
        """Depth of a moment, recomputed.

        Match both foveae by their recorded poses and calibration; refused where these are missing.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/depth",
                path_values={"recording_id": recording_id},
                query={
                    "t_s": t_s,
                    "backend": backend,
                    "looks": looks,
                    "research_confirmed": research_confirmed,
                },
            ),
            models.RecordedDepthDocument,
        )

    def depth_picture(
        self,
        recording_id: str,
        *,
        t_s: float | None = None,
        backend: str | None = None,
        looks: int | None = None,
        research_confirmed: bool | None = None,
    ) -> Download:
        """Depth of a moment as a picture.

        Return depth as colours, with a scale in metres.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/depth.jpg",
                path_values={"recording_id": recording_id},
                query={
                    "t_s": t_s,
                    "backend": backend,
                    "looks": looks,
                    "research_confirmed": research_confirmed,
                },
            )
        )

    def difference(self, recording_id: str, *, t_s: float | None = None) -> Download:
        """The left fovea of a moment minus the right one.

        Return left minus right about middle grey, rectified where poses and calibration were recorded.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/difference.jpg",
                path_values={"recording_id": recording_id},
                query={"t_s": t_s},
            )
        )

    def download(self, recording_id: str) -> Download:
        """The recording's file.

        Send the unchanged file, or the part that a Range header asks for.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/download.fcap",
                path_values={"recording_id": recording_id},
            )
        )

    def fetch_recording(
        self, recording_id: str, *, idempotency_key: str | None = None
    ) -> StartedJob[models.RecordingDocument]:
        """Fetch a recording from the archive.

        Queue the download of the files that are not on this machine, as a job.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/recordings/{recording_id}/fetch",
                path_values={"recording_id": recording_id},
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.RecordingDocument,
        )

    def make_film(
        self, recording_id: str, body: models.FilmRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.FilmDocument]:
        """Make a film, or another export.

        Queue a film as a job; an existing equal film is reused.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/recordings/{recording_id}/films",
                path_values={"recording_id": recording_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.FilmDocument,
        )

    def film(self, recording_id: str, name: str) -> Download:
        """A film that was made.

        Send a film.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/films/{name}",
                path_values={"recording_id": recording_id, "name": name},
            )
        )

    def frames(
        self,
        recording_id: str,
        *,
        t_s: float | None = None,
        role: Literal["wide", "left", "right"] | None = None,
        index: str | None = None,
    ) -> models.MomentDocument:
        """The frames of a moment, with their poses.

        Return all cameras' frames nearest to a time, or to a frame of one camera, with poses and
        outlines.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/frames",
                path_values={"recording_id": recording_id},
                query={"t_s": t_s, "role": role, "index": index},
            ),
            models.MomentDocument,
        )

    def frame(
        self,
        recording_id: str,
        role: Literal["wide", "left", "right"],
        index: int,
        *,
        scale: Literal["1", "2"] | None = None,
    ) -> Download:
        """One frame as JPEG.

        Return one frame of one camera.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/frames/{role}/{index}.jpg",
                path_values={"recording_id": recording_id, "role": role, "index": index},
                query={"scale": scale},
            )
        )

    def layout(self, recording_id: str) -> models.LayoutDocument:
        """Stored arrangement of the player.

        Return the arrangement stored beside the recording, or why it cannot be used.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET", "/api/v1/recordings/{recording_id}/layout", path_values={"recording_id": recording_id}
            ),
            models.LayoutDocument,
        )

    def keep_layout(self, recording_id: str, body: models.LayoutRequest) -> models.LayoutDocument:
        """Store the arrangement of the player.

        Store the arrangement beside the recording. One that cannot be used is overwritten only with
        `replace`.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "PUT",
                "/api/v1/recordings/{recording_id}/layout",
                path_values={"recording_id": recording_id},
                body=body,
            ),
            models.LayoutDocument,
        )

    def restore(self, recording_id: str) -> models.RecordingDocument:
        """Restore a recording from the trash.

        Restore a recording from the trash.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "POST",
                "/api/v1/recordings/{recording_id}/restore",
                path_values={"recording_id": recording_id},
            ),
            models.RecordingDocument,
        )

    def stop(self, recording_id: str) -> models.RecordingDocument:
        """End a recording.

        End a recording; returns when its file is complete. No effect on one that has ended.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call(
                "POST", "/api/v1/recordings/{recording_id}/stop", path_values={"recording_id": recording_id}
            ),
            models.RecordingDocument,
        )

    def timeline(self, recording_id: str) -> models.TimelineDocument:
        """Exposure times of all frames.

        Return the exposure times of all frames, by camera.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET",
                "/api/v1/recordings/{recording_id}/timeline",
                path_values={"recording_id": recording_id},
            ),
            models.TimelineDocument,
        )

    def tracks(self, recording_id: str) -> models.TracksDocument:
        """All channels over time, in short.

        Return runs, gaps and drops of every channel, from the file's index alone.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call(
                "GET", "/api/v1/recordings/{recording_id}/tracks", path_values={"recording_id": recording_id}
            ),
            models.TracksDocument,
        )


class References:
    """Operations of `references`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self, capture_id: str) -> models.ReferenceDocument:
        """A capture's reference.

        Return the reference's figures and files, its job's progress, or why none is possible.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/captures/{capture_id}/reference", path_values={"capture_id": capture_id}),
            models.ReferenceDocument,
        )

    def make(
        self,
        capture_id: str,
        body: models.ReferenceRequest | None = None,
        *,
        idempotency_key: str | None = None,
    ) -> StartedJob[models.ReferenceDocument]:
        """Make a capture's reference.

        Queue a reference as a job without the rig; refuse at once one that the capture's index rules
        out. An older reference of the capture stays until the new one is finished.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/captures/{capture_id}/reference",
                path_values={"capture_id": capture_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.ReferenceDocument,
        )

    def remove(self, capture_id: str) -> None:
        """Remove a capture's reference.

        Remove the files of the reference; the capture stays.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/captures/{capture_id}/reference", path_values={"capture_id": capture_id})
        )

    def picture(self, capture_id: str, form: Literal["svg", "png"]) -> Download:
        """The comparison as a picture.

        Return the error of the rig's own depth against the reference, over depth.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/reference/comparison.{form}",
                path_values={"capture_id": capture_id, "form": form},
            )
        )

    def samples(self, capture_id: str) -> Download:
        """The samples as a table.

        Return one row per sample: position, depth by the rig and by the reference, and their errors.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/captures/{capture_id}/reference/samples.csv",
                path_values={"capture_id": capture_id},
            )
        )


class Retention:
    """Operations of `retention`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.RetentionPreview:
        """What the rules would remove now.

        Return the rules, and all that they would remove, with the reason of each.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/retention"), models.RetentionPreview)

    def apply(self, body: models.RetentionRequest) -> models.RetentionApplied:
        """Move it to the trash, or delete it where its kind has none.

        Remove exactly the items of a preview, by its digest; nothing when something changed meanwhile.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("POST", "/api/v1/retention", body=body), models.RetentionApplied)


class Rig:
    """Operations of `rig`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.RigDocument:
        """Last status of the rig.

        Return the rig's state, its problems, its devices and its calibration.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rig"), models.RigDocument)

    def binning(self) -> models.RigBinningDocument:
        """Working binning of the cameras.

        Return the working binning, the one in force now, and how long the last switch took.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rig/binning"), models.RigBinningDocument)

    def choose_binning(self, body: models.BinningRequest) -> models.RigBinningDocument:
        """Choose the working binning.

        Switch all cameras, or none; while a session or a recording holds them, after its end
        (`held_by`). Following pauses for the switch. The binning of the rig file, or of `serve
        --binning`, applies again when the rig is opened anew.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/rig/binning", body=body), models.RigBinningDocument
        )

    def start(self) -> models.StartDocument:
        """The rig's start, step by step.

        Return each step of the rig's last start: pending, active, done, or failed and why.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rig/start"), models.StartDocument)


class RigSetup:
    """Operations of `rig_setup`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def advice(self) -> builtins.list[models.AdviceDocument]:
        """What the doctor finds about the draft.

        Check cameras, ports and machine for the draft's devices, with the cameras of the last search.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/rig/setup/advice"), builtins.list[models.AdviceDocument]
        )

    def devices(self) -> models.FoundDevices:
        """Cameras and ports on every bus.

        Search all buses for cameras and serial ports, which takes seconds; nothing is opened.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rig/setup/devices"), models.FoundDevices)

    def draft(self) -> models.DraftDocument:
        """The draft of a rig file.

        Return the draft, its file, and what is wrong with it, field by field.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rig/setup/draft"), models.DraftDocument)

    def begin_draft(self, body: models.DraftStart) -> models.DraftDocument:
        """Begin a draft anew.

        Begin from a rig file of the list, or from an empty draft; unsaved changes are lost.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/rig/setup/draft", body=body), models.DraftDocument
        )

    def change_draft(self, body: models.RigDraft) -> models.DraftDocument:
        """Change the draft.

        Replace the draft's values; invalid ones are kept, and listed as faults in the answer.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("PUT", "/api/v1/rig/setup/draft", body=body), models.DraftDocument)

    def rig_file(self) -> models.RigFileDocument:
        """The rig file and what saving changes.

        Return the file's hash, the changes that saving would make, and what others have changed
        meanwhile.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rig/setup/file"), models.RigFileDocument)

    def save_file(self, body: models.FileOrder) -> models.RigFileDocument:
        """Save the rig file.

        Merge the draft into its file if the file still has the seen hash; comments and other keys stay.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/rig/setup/file", body=body), models.RigFileDocument
        )

    def files(self) -> models.RigFiles:
        """The rig files that can be opened.

        Return the command line's rig file and those of the data directory, with the faults of each.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rig/setup/files"), models.RigFiles)

    def mirror_steps(self, body: models.MirrorStepOrder) -> models.TryResult:
        """A small step of the mirrors.

        Move each mirror of the open rig a small step and back; needs the lease.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/rig/setup/mirror_steps", body=body), models.TryResult
        )

    def open_rig(self, body: models.OpenOrder) -> models.RigFiles:
        """Open another rig.

        Park and close the rig, then open that of a rig file, without restarting the server.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("POST", "/api/v1/rig/setup/open", body=body), models.RigFiles)

    def picture(self, *, kind: Literal["aravis", "pylon", "opencv", "simulated"], name: str) -> Download:
        """A picture of a found camera.

        Return a picture as JPEG; a camera that is not in use is opened briefly.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/rig/setup/picture.jpg", query={"kind": kind, "name": name})
        )

    def try_device(self, body: models.TryOrder) -> models.TryResult:
        """Identify a device of the draft.

        Identify the device on the port; nothing moves or is switched on.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("POST", "/api/v1/rig/setup/tries", body=body), models.TryResult)

    def undo(self, body: models.FileOrder) -> models.RigFileDocument:
        """Put the file's last version back.

        Undo the last save if the file still has the seen hash.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/rig/setup/undo", body=body), models.RigFileDocument
        )


class Rigs:
    """Operations of `rigs`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.RigEntry]:
        """This rig, and the others of the lab.

        Return this rig first, then those of the list and the announced ones, each with its present
        state.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/rigs"), builtins.list[models.RigEntry])

    def picture(self, rig_id: str) -> Download:
        """The wide picture of another rig.

        Return the newest wide picture of a rig of the list, read through this server.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/rigs/{rig_id}/picture.jpg", path_values={"rig_id": rig_id})
        )


class ServiceTokens:
    """Operations of `service_tokens`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> models.ServiceTokenList:
        """All tokens.

        Return the tokens of services, without their secrets.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("GET", "/api/v1/service_tokens"), models.ServiceTokenList)

    def add(self, body: models.ServiceTokenRequest) -> models.ServiceTokenCreated:
        """Add a token.

        Return a new token, whose rights never exceed its owner's; its secret is shown only this once.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/service_tokens", body=body), models.ServiceTokenCreated
        )

    def revoke(self, token_id: str) -> None:
        """Revoke a token.

        Revoke a token; its open streams end.

        Needs the right `administer`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/service_tokens/{token_id}", path_values={"token_id": token_id})
        )


class Session:
    """Operations of `session`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.SignInDocument:
        """Who I am.

        Return the sign-in that the server requires, and the principal of this request.
        """
        return self._transport.answer(Call("GET", "/api/v1/session"), models.SignInDocument)

    def sign_in(self, body: models.SignInRequest) -> models.SignInDocument:
        """Sign in.

        Sign a browser in: the answer sets its cookies. Wrong passwords block their address for a time.
        """
        return self._transport.answer(Call("POST", "/api/v1/session", body=body), models.SignInDocument)

    def sign_out(self) -> None:
        """Sign out.

        Sign this browser out: its cookie is refused from now on, from any address.

        Needs the right `view`.
        """
        self._transport.order(Call("DELETE", "/api/v1/session"))

    def join(self, body: models.JoinRequest) -> models.SignInDocument:
        """Join by a link.

        Set the password of the link's user; sign this browser in, and all others of the user out.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/session/invitation", body=body), models.SignInDocument
        )

    def change_password(self, body: models.PasswordChange) -> None:
        """Change my password.

        Change the user's own password; signs out all other browsers of the user.

        Needs the right `view`.
        """
        self._transport.order(Call("PUT", "/api/v1/session/password", body=body))


class Sessions:
    """Operations of `sessions`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> models.UserSessionList:
        """Who is signed in.

        Return the browsers in which users are signed in: an admin sees all, others see their own.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/sessions"), models.UserSessionList)

    def sign_out(self, session_id: str) -> None:
        """Sign out.

        Sign a browser out: its cookie is refused from now on, its open streams end.

        Needs the right `view`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/sessions/{session_id}", path_values={"session_id": session_id})
        )


class SettleTime:
    """Operations of `settle_time`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.SettleTimeDocument:
        """The settle time in use.

        Return the wait after every move, and the source of that time.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/settle_time"), models.SettleTimeDocument)

    def apply(self, body: models.SettleTimeRequest) -> models.SettleTimeDocument:
        """Put a measured settle time in use.

        Put a session's measured settle time in use, now and at every start.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/settle_time", body=body), models.SettleTimeDocument
        )

    def forget(self) -> models.SettleTimeDocument:
        """Use the rig file's settle time again.

        Put the rig file's settle time in use, now and at every start; the session's measurement stays.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/settle_time"), models.SettleTimeDocument)


class Simulation:
    """Operations of `simulation`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def faults(self) -> models.SimulatedFaults:
        """Injected faults.

        Return the faults injected now; a real rig has none (404).

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/simulation/faults"), models.SimulatedFaults)

    def break_it(self, body: models.SimulatedFaults) -> models.SimulatedFaults:
        """Inject faults.

        Inject these faults into the simulated rig and remove all others, at once, whatever runs.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/simulation/faults", body=body), models.SimulatedFaults
        )

    def mend(self) -> models.SimulatedFaults:
        """Mend everything.

        Remove all faults, with the mounts back in their built positions.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/simulation/faults"), models.SimulatedFaults)


class Stills:
    """Operations of `stills`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(
        self, *, text: str | None = None, state: Literal["held", "kept", "removed"] | None = None
    ) -> builtins.list[models.StillDocument]:
        """Stills, newest first.

        Return all stills of one state, or those that contain every word of `text`.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/stills", query={"text": text, "state": state}),
            builtins.list[models.StillDocument],
        )

    def create(
        self, body: models.StillRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.StillDocument]:
        """Take a still.

        Queue a still as a job. If a camera stalls, the job fails and names it; the frames so far are
        held.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/stills", body=body, idempotent=True, idempotency_key=idempotency_key),
            models.StillDocument,
        )

    def empty_trash(self) -> models.TrashEmptied:
        """Empty the trash.

        Delete the stills in the trash for good.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/stills/trash"), models.TrashEmptied)

    def get(self, still_id: str) -> models.StillDocument:
        """One still.

        Return one still, held or kept.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/stills/{still_id}", path_values={"still_id": still_id}), models.StillDocument
        )

    def patch(self, still_id: str, body: models.StillPatch) -> models.StillDocument:
        """Describe a still.

        Change a still's label or licence.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PATCH", "/api/v1/stills/{still_id}", path_values={"still_id": still_id}, body=body),
            models.StillDocument,
        )

    def remove(self, still_id: str) -> None:
        """Discard or remove a still.

        Move a still to the trash, from which it can be restored.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/stills/{still_id}", path_values={"still_id": still_id}))

    def archive_still(
        self, still_id: str, body: models.ArchiveRequest, *, idempotency_key: str | None = None
    ) -> StartedJob[models.StillDocument]:
        """Send a still to the archive.

        Queue the upload as a job; files that the archive already has are not sent again.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/stills/{still_id}/archive",
                path_values={"still_id": still_id},
                body=body,
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.StillDocument,
        )

    def picture(
        self,
        still_id: str,
        camera: Literal["wide", "left", "right"],
        form: Literal["jpg", "png", "tiff"],
        *,
        frame: str | None = None,
    ) -> Download:
        """Picture of one camera.

        Send a preview of 8 bits (jpg), or the picture of full depth (png, tiff).

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/stills/{still_id}/cameras/{camera}.{form}",
                path_values={"still_id": still_id, "camera": camera, "form": form},
                query={"frame": frame},
            )
        )

    def check_files(self, still_id: str) -> models.StillCheck:
        """Verify every file.

        Read every file of the still's dataset again, and list those that have changed since it was
        written.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/stills/{still_id}/check", path_values={"still_id": still_id}),
            models.StillCheck,
        )

    def download(self, still_id: str) -> Download:
        """The still's dataset as one ZIP file.

        Send the dataset's folder with unchanged files.

        Needs the right `view`.
        """
        return self._transport.download(
            Call("GET", "/api/v1/stills/{still_id}/download.zip", path_values={"still_id": still_id})
        )

    def fetch_still(
        self, still_id: str, *, idempotency_key: str | None = None
    ) -> StartedJob[models.StillDocument]:
        """Fetch a still from the archive.

        Queue the download of the files that are not on this machine, as a job.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call(
                "POST",
                "/api/v1/stills/{still_id}/fetch",
                path_values={"still_id": still_id},
                idempotent=True,
                idempotency_key=idempotency_key,
            ),
            models.StillDocument,
        )

    def keep(self, still_id: str, body: models.StillKeepRequest | None = None) -> models.StillDocument:
        """Keep a still that is held.

        Keep a held still, under another name if one is given.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/stills/{still_id}/keep", path_values={"still_id": still_id}, body=body),
            models.StillDocument,
        )

    def restore(self, still_id: str) -> models.StillDocument:
        """Restore a still from the trash.

        Restore a still from the trash; a discarded one is kept afterwards.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/stills/{still_id}/restore", path_values={"still_id": still_id}),
            models.StillDocument,
        )

    def drawing_of(
        self, still_id: str, drawn: Literal["thumbnail", "coverage", "anaglyph"], form: Literal["jpg", "png"]
    ) -> Download:
        """Where the foveae looked, or both in red and cyan.

        Draw a small wide view with both outlines, a large one, or the rectified pair.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET",
                "/api/v1/stills/{still_id}/{drawn}.{form}",
                path_values={"still_id": still_id, "drawn": drawn, "form": form},
            )
        )


class Stop:
    """Operations of `stop`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.StopDocument:
        """Is the stop engaged?.

        Return whether the stop is engaged, since when and by whom.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/stop"), models.StopDocument)

    def engage(self) -> models.StopAnswer:
        """Stop: park the mirrors now.

        Park the mirrors, cancel every job, and refuse all moves until released. Returns when the
        mirrors' controller has confirmed, or its driver has timed out.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("POST", "/api/v1/stop"), models.StopAnswer)

    def release(self) -> models.StopDocument:
        """Release the stop.

        Allow moves again.

        Needs the right `operate`.
        """
        return self._transport.answer(Call("DELETE", "/api/v1/stop"), models.StopDocument)


class Suggestions:
    """Operations of `suggestions`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self, *, count: int | None = None) -> builtins.list[models.SuggestionDocument]:
        """Good targets for a first look.

        Return targets of the live wide picture that are textured, salient and within reach of both
        eyes.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/suggestions", query={"count": count}),
            builtins.list[models.SuggestionDocument],
        )

    def check(self, *, count: int | None = None) -> builtins.list[models.SuggestionDocument]:
        """Look at the suggested targets.

        Move the mirrors to suggestions, for 8 s at most; return those on which both foveae verge.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/suggestions/checks", query={"count": count}),
            builtins.list[models.SuggestionDocument],
        )


class Targets:
    """Operations of `targets`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.TargetDocument]:
        """All targets, oldest first.

        Return all targets.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/targets"), builtins.list[models.TargetDocument])

    def get(self, target_id: str) -> models.TargetDocument:
        """One target.

        Return one target.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/targets/{target_id}", path_values={"target_id": target_id}),
            models.TargetDocument,
        )

    def rename(self, target_id: str, body: models.TargetPatch) -> models.TargetDocument:
        """Rename a target.

        Give a target another label.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PATCH", "/api/v1/targets/{target_id}", path_values={"target_id": target_id}, body=body),
            models.TargetDocument,
        )

    def remove(self, target_id: str) -> None:
        """Forget a target.

        Delete a target; its fixation and its cloud stay.

        Needs the right `operate`.
        """
        self._transport.order(
            Call("DELETE", "/api/v1/targets/{target_id}", path_values={"target_id": target_id})
        )

    def look_again(self, target_id: str) -> StartedJob[models.FixationDocument]:
        """Look at a target again.

        Measure a target again; its label stays.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/targets/{target_id}/fixate", path_values={"target_id": target_id}),
            models.FixationDocument,
        )


class Users:
    """Operations of `users`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> models.UserList:
        """All users.

        Return all users.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("GET", "/api/v1/users"), models.UserList)

    def add(self, body: models.UserRequest) -> models.UserCreated:
        """Add a user.

        Add a user; without a password, the answer has a one-time link by which the user sets one. The
        first user is an admin with a password, and is signed in: from then on everybody must sign in.

        Needs the right `administer`.
        """
        return self._transport.answer(Call("POST", "/api/v1/users", body=body), models.UserCreated)

    def change(self, name: str, body: models.UserChange) -> models.UserDocument:
        """Change a user.

        Change a user's role, or whether the user may sign in; effective at once in all open browsers.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("PATCH", "/api/v1/users/{name}", path_values={"name": name}, body=body), models.UserDocument
        )

    def remove(self, name: str, *, tokens: Literal["revoke", "keep"] | None = None) -> models.UserRemoved:
        """Remove a user.

        Remove a user, who is signed out everywhere; what the user made stays, except for tokens. `GET
        /service_tokens` lists beforehand which tokens have this owner; the answer lists which were kept
        or revoked.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("DELETE", "/api/v1/users/{name}", path_values={"name": name}, query={"tokens": tokens}),
            models.UserRemoved,
        )

    def invite(self, name: str) -> models.InvitationDocument:
        """Make a new link.

        Return a one-time link by which the user sets a password, also a forgotten one.

        Needs the right `administer`.
        """
        return self._transport.answer(
            Call("POST", "/api/v1/users/{name}/invitation", path_values={"name": name}),
            models.InvitationDocument,
        )


class ViewLayouts:
    """Operations of `view_layouts`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.WindowLayout]:
        """Named layouts of windows.

        Return all layouts by their names.

        Needs the right `view`.
        """
        return self._transport.answer(
            Call("GET", "/api/v1/views/layouts"), builtins.list[models.WindowLayout]
        )

    def save(self, name: str, body: models.WindowLayoutRequest) -> models.WindowLayout:
        """Save a layout.

        Save a layout, over one of the same name.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/views/layouts/{name}", path_values={"name": name}, body=body),
            models.WindowLayout,
        )

    def delete(self, name: str) -> None:
        """Delete a layout.

        Delete a layout; windows that show it stay.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/views/layouts/{name}", path_values={"name": name}))


class Views:
    """Operations of `views`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def list(self) -> builtins.list[models.ViewDocument]:
        """List the live views.

        Return every view with its measured rate and the age of its newest picture.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/views"), builtins.list[models.ViewDocument])

    def anaglyph_style(self) -> models.AnaglyphColours:
        """Colours of the anaglyph.

        Return the colours of the anaglyph, for all viewers.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/views/anaglyph/style"), models.AnaglyphColours)

    def choose_anaglyph_style(self, body: models.AnaglyphColours) -> models.AnaglyphColours:
        """Choose the colours of the anaglyph.

        Set the colours of the anaglyph for all viewers, from the next picture on.

        Needs the right `operate`.
        """
        return self._transport.answer(
            Call("PUT", "/api/v1/views/anaglyph/style", body=body), models.AnaglyphColours
        )

    def snapshot(self, name: str, *, scale: Literal["1", "2", "4"] | None = None) -> Download:
        """Newest picture of a view.

        Return the newest picture of a view as JPEG; its number, capture time and scale are in the
        headers. If it is older than 1.5 s, as without viewers, the answer waits up to a second for the
        next one.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET", "/api/v1/views/{name}/snapshot.jpg", path_values={"name": name}, query={"scale": scale}
            )
        )

    def stream_mjpeg(self, name: str, *, scale: Literal["1", "2", "4"] | None = None) -> Download:
        """Live view as MJPEG, for curl and VLC.

        Stream a view endlessly; at most two per person; the delay of a slow client grows without bound.

        Needs the right `view`.
        """
        return self._transport.download(
            Call(
                "GET", "/api/v1/views/{name}/stream.mjpeg", path_values={"name": name}, query={"scale": scale}
            )
        )


class WideDepth:
    """Operations of `wide_depth`."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport

    def get(self) -> models.WideDepthDocument:
        """Depth of the wide view, in figures.

        Return coverage, age and accuracy of the wide depth.

        Needs the right `view`.
        """
        return self._transport.answer(Call("GET", "/api/v1/wide_depth"), models.WideDepthDocument)

    def forget(self) -> None:
        """Forget the depth of the wide view.

        Forget the whole wide depth; fixations and their clouds stay.

        Needs the right `operate`.
        """
        self._transport.order(Call("DELETE", "/api/v1/wide_depth"))

    def ply(self) -> Download:
        """Depth of the wide view as points.

        Return x, y, z (m, rig frame), colour and sigma of every cell's surfaces.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/wide_depth.ply"))

    def png(self) -> Download:
        """Depth of the wide view as a picture.

        Return a heat map with its scale; what is unknown is striped.

        Needs the right `view`.
        """
        return self._transport.download(Call("GET", "/api/v1/wide_depth.png"))

    def look_around(self, *, idempotency_key: str | None = None) -> StartedJob[models.WideDepthDocument]:
        """Look around.

        Queue looks over the whole steering field; what they found is kept when the job is cancelled.

        Needs the right `operate`.
        """
        return self._transport.start(
            Call("POST", "/api/v1/wide_depth/surveys", idempotent=True, idempotency_key=idempotency_key),
            models.WideDepthDocument,
        )


class Operations:
    """All operations, by noun."""

    def __init__(self, transport: Transport) -> None:
        self.acceptances = Acceptances(transport)
        self.archive = Archive(transport)
        self.audit = Audit(transport)
        self.batches = Batches(transport)
        self.calibration_sessions = CalibrationSessions(transport)
        self.calibrations = Calibrations(transport)
        self.camera_presets = CameraPresets(transport)
        self.camera_self_tests = CameraSelfTests(transport)
        self.cameras = Cameras(transport)
        self.captures = Captures(transport)
        self.clouds = Clouds(transport)
        self.depth = Depth(transport)
        self.display_pattern = DisplayPattern(transport)
        self.displays = Displays(transport)
        self.drift_checks = DriftChecks(transport)
        self.engine = Engine(transport)
        self.events = Events(transport)
        self.exports = Exports(transport)
        self.faults = Faults(transport)
        self.fixations = Fixations(transport)
        self.follows = Follows(transport)
        self.health = Health(transport)
        self.jobs = Jobs(transport)
        self.lease = Lease(transport)
        self.lease_wishes = LeaseWishes(transport)
        self.loop = Loop(transport)
        self.loop_settings = LoopSettings(transport)
        self.measurements = Measurements(transport)
        self.mirrors = Mirrors(transport)
        self.mosaics = Mosaics(transport)
        self.pan_tilt = PanTilt(transport)
        self.planner = Planner(transport)
        self.rail = Rail(transport)
        self.reach = Reach(transport)
        self.recording_uploads = RecordingUploads(transport)
        self.recordings = Recordings(transport)
        self.references = References(transport)
        self.retention = Retention(transport)
        self.rig = Rig(transport)
        self.rig_setup = RigSetup(transport)
        self.rigs = Rigs(transport)
        self.service_tokens = ServiceTokens(transport)
        self.session = Session(transport)
        self.sessions = Sessions(transport)
        self.settle_time = SettleTime(transport)
        self.simulation = Simulation(transport)
        self.stills = Stills(transport)
        self.stop = Stop(transport)
        self.suggestions = Suggestions(transport)
        self.targets = Targets(transport)
        self.users = Users(transport)
        self.view_layouts = ViewLayouts(transport)
        self.views = Views(transport)
        self.wide_depth = WideDepth(transport)
