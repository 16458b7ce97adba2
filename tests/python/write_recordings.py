"""Writes the frames of an episode as recordings, in the words of each format and with nothing of Nudge's own code.

    write_recordings.py FRAMES OUT

FRAMES holds frames.json (the camera, and position and quaternion of every frame), NNN.depth (float32, metres) and NNN.label
(uint8). OUT gets a folder for every format:

    npy        depth as float32, poses as quaternions: nothing is lost
    png        depth in units of 0.1 mm          tum        TUM RGB-D, 0.2 mm
    nerf       Nerfstudio, 1 mm                  bop        BOP, 1 mm
    npy-10000, npy-5000, npy-1000-matrix         the depth of the formats with 0.1, 0.2 and 1 mm, as float32
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image


def matrix(frame):
    """world_from_camera as 4 x 4, from a quaternion x, y, z, w."""
    x, y, z, w = frame["quaternion"] / np.linalg.norm(frame["quaternion"])
    pose = np.eye(4)
    pose[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose[:3, 3] = frame["position"]
    return pose


def text(numbers):
    """Numbers that read back as the very same."""
    return " ".join(repr(float(number)) for number in np.ravel(numbers))


def seven(frame):
    return text(list(frame["position"]) + list(frame["quaternion"]))


def save(path, values):
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npy":
        np.save(path, values)
    elif path.suffix == ".png":
        Image.fromarray(values).save(path)
    else:
        path.write_text(values)


def units(depth, per_metre):
    counts = np.round(depth.astype(np.float64) * per_metre)
    assert counts.max() < 65536
    return counts.astype(np.uint16)


def main(source, out):
    camera = json.loads((source / "frames.json").read_text())
    w, h, fx, fy, cx, cy = (camera[key] for key in ["width", "height", "fx", "fy", "cx", "cy"])
    # Nudge's pixel centres are at a half; OpenCV's have whole numbers.
    intrinsics = {"width": w, "height": h, "fx": fx, "fy": fy, "cx": cx - 0.5, "cy": cy - 0.5}
    frames = camera["frames"]
    for at, frame in enumerate(frames):
        frame["depth"] = np.fromfile(source / f"{at:03}.depth", "<f4").reshape(h, w)
        frame["label"] = np.fromfile(source / f"{at:03}.label", "u1").reshape(h, w)

    def folder(name, depth_of, end, scale, pose=seven):
        save(out / name / "intrinsics.json", json.dumps({**intrinsics, "depth_scale": scale}))
        for at, frame in enumerate(frames):
            save(out / name / "depth" / f"{at:03}.{end}", depth_of(frame["depth"]))
            save(out / name / "label" / f"{at:03}.png", frame["label"])
            save(out / name / "pose" / f"{at:03}.txt", pose(frame))

    def rounded(per_metre):
        return lambda depth: (units(depth, per_metre) / per_metre).astype(np.float32)

    folder("npy", lambda depth: depth, "npy", 1)
    folder("png", lambda depth: units(depth, 10000), "png", 10000)
    folder("npy-10000", rounded(10000), "npy", 1)
    folder("npy-5000", rounded(5000), "npy", 1)
    folder("npy-1000-matrix", rounded(1000), "npy", 1, lambda frame: text(matrix(frame)))

    # TUM: lists with times; the poses come more often than the images, and there are more of them.
    tum, poses, images = out / "tum", ["# ground truth trajectory"], ["# depth maps", "# timestamp filename"]
    save(tum / "intrinsics.json", json.dumps(intrinsics))
    for at, frame in enumerate(frames):
        stamp = 1305031102.1 + at / 30
        poses.append(f"{stamp + 0.001:.6f} {seven(frame)}")
        poses.append(f"{stamp + 0.015:.6f} 9 9 9 0 0 0 1")
        images.append(f"{stamp:.6f} depth/{stamp:.6f}.png")
        save(tum / "depth" / f"{stamp:.6f}.png", units(frame["depth"], 5000))
        save(tum / "label" / f"{stamp:.6f}.png", frame["label"])
    save(tum / "groundtruth.txt", "\n".join(poses) + "\n")
    save(tum / "depth.txt", "\n".join(images) + "\n")

    # Nerfstudio: OpenGL's axes, centres of pixels at a half.
    nerf = out / "nerf"
    listed = []
    for at, frame in enumerate(frames):
        opengl = matrix(frame) @ np.diag([1.0, -1.0, -1.0, 1.0])
        paths = {"depth_file_path": f"depth/{at:03}.png", "label_file_path": f"label/{at:03}.png"}
        listed.append({"file_path": f"images/{at:03}.png", "transform_matrix": opengl.tolist(), **paths})
        save(nerf / "depth" / f"{at:03}.png", units(frame["depth"], 1000))
        save(nerf / "label" / f"{at:03}.png", frame["label"])
    head = {"camera_model": "OPENCV", "fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy, "w": w, "h": h}
    save(nerf / "transforms.json", json.dumps({**head, "frames": listed}))

    # BOP: world to camera, millimetres, a mask for each object. Objects are counted from 1.
    bop, cameras, truth = out / "bop", {}, {}
    for at, frame in enumerate(frames):
        inverse = np.linalg.inv(matrix(frame))
        cameras[str(at)] = {
            "cam_K": [fx, 0, cx - 0.5, 0, fy, cy - 0.5, 0, 0, 1],
            "depth_scale": 1.0,
            "cam_R_w2c": inverse[:3, :3].ravel().tolist(),
            "cam_t_w2c": (1000 * inverse[:3, 3]).tolist(),
        }
        save(bop / "depth" / f"{at:06}.png", units(frame["depth"], 1000))
        truth[str(at)] = []
        for number, label in enumerate(np.unique(frame["label"])):
            truth[str(at)].append({"obj_id": int(label) + 1, "cam_R_m2c": [], "cam_t_m2c": []})
            mask = np.where(frame["label"] == label, 255, 0).astype(np.uint8)
            save(bop / "mask_visib" / f"{at:06}_{number:06}.png", mask)
    save(bop / "scene_camera.json", json.dumps(cameras))
    save(bop / "scene_gt.json", json.dumps(truth))


main(Path(sys.argv[1]), Path(sys.argv[2]))
