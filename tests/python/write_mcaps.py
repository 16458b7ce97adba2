"""Writes the frames of an episode as MCAP files of ROS 2, with two libraries that others wrote.

    write_mcaps.py FRAMES OUT

FRAMES is as for write_recordings.py. OUT gets

    tf-zstd.mcap      mcap-ros2-support: Image 32FC1, labels mono8, poses from /tf; zstd chunks
    chain.mcap        the same with an arm between board and camera, and axes of a body; lz4 chunks
    png-lz4.mcap      mcap-ros2-support: compressedDepth as PNG (16UC1), labels as PNG, PoseStamped; lz4 chunks
    rvl-none.mcap     mcap-ros2-support: compressedDepth as RVL, PoseStamped; no compression
    rosbags.mcap      rosbags: Image 32FC1, labels mono16, PoseStamped, and the arm's joints (JointState), last one first
    no-info.mcap      no CameraInfo
    npy-1000          the depth of whole millimetres as a plain folder of float32
"""

import io
import json
import shutil
import struct
import sys
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as RosWriter
from PIL import Image
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

HEADER = "builtin_interfaces/Time stamp\nstring frame_id\n"
TIME = "int32 sec\nuint32 nanosec\n"
LINE = "=" * 80 + "\n"


def part(name, text):
    return f"{LINE}MSG: {name}\n{text}"


HEADERS = part("std_msgs/Header", HEADER) + part("builtin_interfaces/Time", TIME)
POINTS = part("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n")
DEFINITIONS = {
    "sensor_msgs/msg/Image": "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
    "uint32 step\nuint8[] data\n" + HEADERS,
    "sensor_msgs/msg/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data\n" + HEADERS,
    "sensor_msgs/msg/CameraInfo": "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\n"
    "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
    "sensor_msgs/RegionOfInterest roi\n"
    + HEADERS
    + part("sensor_msgs/RegionOfInterest", "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"),
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n"
    + part(
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    )
    + part("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n")
    + part("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n")
    + POINTS
    + HEADERS,
    "geometry_msgs/msg/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose\n"
    + part("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n")
    + part("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n")
    + POINTS
    + HEADERS,
}
START = 1_700_000_000_000_000_000


def stamp(at, late=0):
    return START + at * 33_000_000 + late


def header(time_ns, frame):
    return {"stamp": {"sec": time_ns // 10**9, "nanosec": time_ns % 10**9}, "frame_id": frame}


def xyz(v):
    return dict(zip("xyz", map(float, v)))


def xyzw(q):
    return dict(zip("xyzw", map(float, q)))


def image(time_ns, array, encoding):
    array = np.ascontiguousarray(array)
    height, width = array.shape
    step = width * array.itemsize
    return {
        "header": header(time_ns, "camera_optical"),
        "height": height,
        "width": width,
        "encoding": encoding,
        "is_bigendian": 0,
        "step": step,
        "data": array.tobytes(),
    }


def png(array):
    buffer = io.BytesIO()
    Image.fromarray(array).save(buffer, "png")
    return buffer.getvalue()


def compressed(time_ns, form, data):
    return {"header": header(time_ns, "camera_optical"), "format": form, "data": data}


def rvl(values):
    """RVL as Wilson (2017) describes it; slow and plain."""
    groups = []

    def number(value):
        while True:
            more = value > 7
            groups.append((value & 7) | (8 if more else 0))
            value >>= 3
            if not more:
                return

    flat, before, at = values.ravel().astype(int).tolist(), 0, 0
    while at < len(flat):
        zeros = at
        while at < len(flat) and flat[at] == 0:
            at += 1
        number(at - zeros)
        first = at
        while at < len(flat) and flat[at] != 0:
            at += 1
        number(at - first)
        for value in flat[first:at]:
            step = value - before
            number((step << 1) ^ (step >> 31) if step >= 0 else ((-step) << 1) - 1)
            before = value
    groups += [0] * (-len(groups) % 8)
    words = [sum(group << (28 - 4 * k) for k, group in enumerate(groups[i : i + 8])) for i in range(0, len(groups), 8)]
    return struct.pack("<II", values.shape[1], values.shape[0]) + struct.pack(f"<{len(words)}I", *words)


def camera_info(camera, time_ns):
    fx, fy, cx, cy = camera["fx"], camera["fy"], camera["cx"] - 0.5, camera["cy"] - 0.5
    return {
        "header": header(time_ns, "camera_optical"),
        "height": camera["height"],
        "width": camera["width"],
        "distortion_model": "plumb_bob",
        "d": [0.0] * 5,
        "k": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "r": [1.0, 0, 0, 0, 1, 0, 0, 0, 1],
        "p": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        "binning_x": 0,
        "binning_y": 0,
        "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
    }


def transform(time_ns, parent, child, position, quaternion):
    placed = {"translation": xyz(position), "rotation": xyzw(quaternion)}
    return {"header": header(time_ns, parent), "child_frame_id": child, "transform": placed}


def pose_stamped(time_ns, frame):
    pose = {"position": xyz(frame["position"]), "orientation": xyzw(frame["quaternion"])}
    return {"header": header(time_ns, "board"), "pose": pose}


class Ros:
    """A file written by mcap-ros2-support."""

    def __init__(self, path, compression):
        self.file = open(path, "wb")
        self.writer = RosWriter(self.file, chunk_size=1 << 20, compression=compression)
        self.schemas = {name: self.writer.register_msgdef(name, text) for name, text in DEFINITIONS.items()}

    def write(self, topic, kind, time_ns, message):
        self.writer.write_message(topic, self.schemas[kind], message, log_time=time_ns, publish_time=time_ns)

    def close(self):
        self.writer.finish()
        self.file.close()


def multiply(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]


def main(source, out):
    camera = json.loads((source / "frames.json").read_text())
    frames = camera["frames"]
    for at, frame in enumerate(frames):
        shape = camera["height"], camera["width"]
        frame["depth"] = np.fromfile(source / f"{at:03}.depth", "<f4").reshape(shape)
        frame["label"] = np.fromfile(source / f"{at:03}.label", "u1").reshape(shape)
        frame["mm"] = np.round(frame["depth"].astype(np.float64) * 1000).astype(np.uint16)

    def infos(ros, at):
        ros.write("/camera/camera_info", "sensor_msgs/msg/CameraInfo", stamp(at), camera_info(camera, stamp(at)))

    # Depth of real numbers has holes that are no numbers, as ROS marks them (REP 117).
    def depth(frame):
        return np.where(frame["depth"] > 0, frame["depth"], np.float32("nan"))

    for name, compression in [("tf-zstd", CompressionType.ZSTD), ("chain", CompressionType.LZ4)]:
        ros = Ros(out / f"{name}.mcap", compression)
        if name == "chain":
            # The hand holds the camera's body: 10 cm ahead of the hand, turned from optical axes to a body's.
            fixed = transform(0, "hand", "camera_body", [0.1, 0, 0], [0, 0, 0, 1])
            ros.write("/tf_static", "tf2_msgs/msg/TFMessage", stamp(0), {"transforms": [fixed]})
        for at, frame in enumerate(frames):
            position, quaternion = frame["position"], frame["quaternion"]
            if name == "chain":
                # optical_from_body, and the hand behind the body.
                quaternion = multiply(quaternion, [0.5, -0.5, 0.5, 0.5])
                x, y, z, w = quaternion
                ahead = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])
                moved = transform(stamp(at), "board", "hand", np.array(position) - 0.1 * ahead, quaternion)
            else:
                moved = transform(stamp(at, 1_000_000), "board", "camera_optical", position, quaternion)
            ros.write("/tf", "tf2_msgs/msg/TFMessage", stamp(at), {"transforms": [moved]})
            infos(ros, at)
            ros.write("/camera/depth", "sensor_msgs/msg/Image", stamp(at), image(stamp(at), depth(frame), "32FC1"))
            ros.write("/labels", "sensor_msgs/msg/Image", stamp(at), image(stamp(at), frame["label"], "mono8"))
        ros.close()

    for name, compression in [("png-lz4", CompressionType.LZ4), ("rvl-none", CompressionType.NONE), ("no-info", CompressionType.NONE)]:
        ros = Ros(out / f"{name}.mcap", compression)
        for at, frame in enumerate(frames):
            kind = "rvl" if name.startswith("rvl") else "png"
            data = rvl(frame["mm"]) if kind == "rvl" else png(frame["mm"])
            message = compressed(stamp(at), f"16UC1; compressedDepth {kind}", struct.pack("<iff", 0, 0, 0) + data)
            ros.write("/camera/depth/compressedDepth", "sensor_msgs/msg/CompressedImage", stamp(at), message)
            if name != "no-info":
                infos(ros, at)
            labels = compressed(stamp(at), "mono8; png compressed ", png(frame["label"]))
            ros.write("/labels/compressed", "sensor_msgs/msg/CompressedImage", stamp(at), labels)
            ros.write("/camera_pose", "geometry_msgs/msg/PoseStamped", stamp(at), pose_stamped(stamp(at), frame))
        ros.close()

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types

    def ros_header(at):
        time = types["builtin_interfaces/msg/Time"](sec=stamp(at) // 10**9, nanosec=stamp(at) % 10**9)
        return types["std_msgs/msg/Header"](stamp=time, frame_id="camera_optical")

    with BagWriter(out / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        kinds = {
            "/camera/depth": "sensor_msgs/msg/Image",
            "/labels": "sensor_msgs/msg/Image",
            "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
            "/camera_pose": "geometry_msgs/msg/PoseStamped",
            "/joint_states": "sensor_msgs/msg/JointState",
        }
        connections = {topic: bag.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for at, frame in enumerate(frames):

            def write(topic, message):
                bag.write(connections[topic], stamp(at), store.serialize_cdr(message, kinds[topic]))

            def ros_image(array, encoding):
                height, width = array.shape
                return types["sensor_msgs/msg/Image"](
                    header=ros_header(at),
                    height=height,
                    width=width,
                    encoding=encoding,
                    is_bigendian=0,
                    step=width * array.itemsize,
                    data=np.frombuffer(np.ascontiguousarray(array).tobytes(), np.uint8),
                )

            info = camera_info(camera, stamp(at))
            roi = types["sensor_msgs/msg/RegionOfInterest"](**info["roi"])
            numbers = {key: np.array(info[key], np.float64) for key in "dkrp"}
            write("/camera/camera_info", types["sensor_msgs/msg/CameraInfo"](**{**info, **numbers, "header": ros_header(at), "roi": roi}))
            write("/camera/depth", ros_image(depth(frame), "32FC1"))
            write("/labels", ros_image(frame["label"].astype(np.uint16), "mono16"))
            point = types["geometry_msgs/msg/Point"](**xyz(frame["position"]))
            turn = types["geometry_msgs/msg/Quaternion"](**xyzw(frame["quaternion"]))
            pose = types["geometry_msgs/msg/Pose"](position=point, orientation=turn)
            write("/camera_pose", types["geometry_msgs/msg/PoseStamped"](header=ros_header(at), pose=pose))
            if frame["joints"]:
                names, numbers = ["finger", *reversed(camera["joints"])], [0.8, *reversed(frame["joints"])]
                none = np.zeros(0)
                state = types["sensor_msgs/msg/JointState"](
                    header=ros_header(at), name=names, position=np.array(numbers), velocity=none, effort=none
                )
                write("/joint_states", state)
    shutil.move(next((out / "bag").glob("*.mcap")), out / "rosbags.mcap")

    folder = out / "npy-1000"
    for part_of in ["depth", "pose", "label"]:
        (folder / part_of).mkdir(parents=True)
    keys = {key: camera[key] for key in ["width", "height", "fx", "fy"]}
    centre = {"cx": camera["cx"] - 0.5, "cy": camera["cy"] - 0.5}
    (folder / "intrinsics.json").write_text(json.dumps({**keys, **centre}))
    for at, frame in enumerate(frames):
        np.save(folder / "depth" / f"{at:03}.npy", (frame["mm"] / 1000).astype(np.float32))
        Image.fromarray(frame["label"]).save(folder / "label" / f"{at:03}.png")
        seven = list(frame["position"]) + list(frame["quaternion"])
        (folder / "pose" / f"{at:03}.txt").write_text(" ".join(map(repr, seven)))


main(Path(sys.argv[1]), Path(sys.argv[2]))
