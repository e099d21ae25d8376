"""OpenCV and curl look through the gels."""

import shutil
import subprocess

import numpy as np
import pytest

from .rig import Gripper

cv2 = pytest.importorskip("cv2", reason="opencv-python-headless is not installed")
needs_curl = pytest.mark.skipif(shutil.which("curl") is None, reason="curl is not installed")


def curl(*arguments):
    return subprocess.run(["curl", "--silent", "--show-error", *arguments], capture_output=True, timeout=30, check=False)


def decode(jpeg):
    return cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)


def frames(url, count):
    """Frames of a stream, as OpenCV decodes them."""
    video = cv2.VideoCapture(url, cv2.CAP_FFMPEG)
    try:
        assert video.isOpened(), f"{url}; built with: {cv2.videoio_registry.getBackends()}"
        seen = []
        for _ in range(count):
            there, frame = video.read()
            assert there
            seen.append(frame)
        return seen
    finally:
        video.release()


@pytest.mark.parametrize("jaw", ["left", "right"])
def test_opencv_reads_portrait_frames_that_change_with_a_grip(rig, jaw):
    url = rig.camera(jaw, "stream")
    rest = frames(url, 30)
    assert {frame.shape for frame in rest} == {(320, 240, 3)}
    assert np.array_equal(rest[0], rest[-1]), "nothing touches the gel"
    with Gripper(rig.ports["gripper"]) as gripper:
        gripper.move("GRIP(40)")
        gripped = frames(url, 10)
        gripper.move("RELEASE(20)")
        again = frames(url, 10)
    difference = np.abs(gripped[-1].astype(int) - rest[-1])
    assert difference.max() > 15 and 0.001 < (difference.max(axis=2) > 8).mean() < 0.9, "a print, not another picture"
    assert np.array_equal(again[-1], rest[-1])


@needs_curl
def test_curl_gets_a_snapshot_and_a_stream(rig):
    got = curl("--include", rig.camera("left", "snapshot"))
    assert got.returncode == 0, got.stderr
    head, _, body = got.stdout.partition(b"\r\n\r\n")
    assert b" 200 " in head.splitlines()[0] and b"image/jpeg" in head
    assert decode(body).shape == (320, 240, 3)
    # A stream does not end by itself: 28 is curl's word for that.
    got = curl("--max-time", "2", rig.camera("left", "stream"))
    assert got.returncode == 28, got.stderr
    parts = got.stdout.split(b"--boundarydonotcross\r\n")[1:-1]
    assert 40 < len(parts) < 130, "60 frames per second at most, in 2 s"
    stamps = []
    for part in parts:
        head, _, rest = part.partition(b"\r\n\r\n")
        fields = dict(line.split(b": ", 1) for line in head.splitlines())
        assert int(fields[b"Content-Length"]) == len(rest) - 2 and fields[b"Content-Type"] == b"image/jpeg"
        stamps.append(float(fields[b"X-Timestamp"]))
        assert rest[:2] == b"\xff\xd8" and rest[-4:] == b"\xff\xd9\r\n"
    assert all(b > a for a, b in zip(stamps, stamps[1:], strict=False))


@needs_curl
def test_a_frozen_camera_repeats_its_stamp_and_another_page_is_not_there(rig):
    def stamps():
        got = curl("--max-time", "0.5", rig.camera("right", "stream")).stdout
        return {line for line in got.splitlines() if line.startswith(b"X-Timestamp")}

    assert len(stamps()) > 5
    rig.fault("freeze right")
    frozen = stamps()
    rig.fault("thaw right")
    assert len(frozen) == 1
    got = curl("--output", "/dev/null", "--write-out", "%{http_code}", rig.camera("right", "nothing"))
    assert got.stdout == b"404"
