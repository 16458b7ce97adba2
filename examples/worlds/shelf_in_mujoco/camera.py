"""Depth and labels as a camera sees them: by MuJoCo's ray caster, or by its renderer (OpenGL without a display).

Depth is the distance along the optical axis, metres; 0 where nothing is. A camera is a dict as the protocol has it: pixel
centres have whole numbers. Its pose is world_from_camera: x right, y down, z ahead.
"""

import mujoco
import numpy as np

from . import WorldError
from .model import OBJECTS, PANELS
from .shapes import BACKGROUND

# Rounds that take a lens's distortion out of a pixel.
ROUNDS = 30


def rotation(quaternion) -> np.ndarray:
    """The matrix of x, y, z, w."""
    x, y, z, w = quaternion
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.array([w, x, y, z], float))
    return matrix.reshape(3, 3)


def rays(camera: dict) -> np.ndarray:
    """The rays through the pixels' centres in the camera's frame, one metre deep, [H, W, 3]."""
    columns, rows = np.meshgrid(np.arange(camera["width"]), np.arange(camera["height"]))
    x = seen_x = (columns - camera["cx"]) / camera["fx"]
    y = seen_y = (rows - camera["cy"]) / camera["fy"]
    k1, k2, p1, p2, k3 = camera.get("distortion") or [0.0] * 5
    if any([k1, k2, p1, p2, k3]):
        for _ in range(ROUNDS):
            r2 = x * x + y * y
            radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
            dx, dy = 2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
            x, y = (seen_x - dx) / radial, (seen_y - dy) / radial
    return np.stack([x, y, np.ones_like(x)], axis=-1)


class Camera:
    """Takes images of a model. `kind` is `rays` or `gl`; lenses that distort are always seen by rays."""

    def __init__(self, model, labels: np.ndarray, kind: str):
        self.model, self.labels, self.kind = model, labels, kind
        self.renderer = None

    def image(self, data, position, quaternion, camera: dict) -> tuple[np.ndarray, np.ndarray]:
        """Depth (float32) and labels (uint8), [H, W]."""
        is_plain = not any(camera.get("distortion") or [])
        take = self.drawn if self.kind == "gl" and is_plain else self.cast
        depth, geoms = take(data, position, quaternion, camera)
        labels = np.append(self.labels, BACKGROUND).astype(np.uint8)[geoms]
        return np.where(geoms >= 0, depth, 0.0).astype(np.float32), labels

    def close(self) -> None:
        """Gives OpenGL back."""
        if self.renderer is not None:
            self.renderer.close()
            self.renderer = None

    def make_renderer(self, width: int, height: int) -> None:
        """Makes a renderer of images of this size, unless there is one."""
        if self.renderer is not None and (self.renderer.width, self.renderer.height) == (width, height):
            return
        self.close()
        self.model.vis.global_.offwidth, self.model.vis.global_.offheight = width, height
        try:
            self.renderer = mujoco.Renderer(self.model, height, width)
        except Exception as error:  # What OpenGL raises differs from system to system.
            words = " ".join(str(error).split()) or type(error).__name__
            raise WorldError(f"no OpenGL here ({words}); --renderer rays needs none") from None

    def drawn(self, data, position, quaternion, camera: dict) -> tuple[np.ndarray, np.ndarray]:
        """Depth and geoms, -1 for none, by the renderer."""
        self.make_renderer(camera["width"], camera["height"])
        self.aim(data, position, quaternion, camera)
        option = mujoco.MjvOption()
        option.geomgroup[:] = 0
        option.geomgroup[[PANELS, OBJECTS]] = 1
        option.sitegroup[:] = 0
        self.renderer.update_scene(data, "eye", option)
        self.renderer.enable_depth_rendering()
        depth = self.renderer.render().copy()
        self.renderer.enable_segmentation_rendering()
        number, kind = np.moveaxis(self.renderer.render(), -1, 0)
        return depth, np.where(kind == mujoco.mjtObj.mjOBJ_GEOM, number, -1)

    def aim(self, data, position, quaternion, camera: dict) -> None:
        """Puts the model's camera there. MuJoCo's looks along its -z, with y up."""
        model, (width, height) = self.model, (camera["width"], camera["height"])
        model.cam_resolution[0] = [width, height]
        model.cam_sensorsize[0] = [width * 1e-5, height * 1e-5]
        # MuJoCo counts the principal point from the image's middle, to the left and upwards.
        shift = [0.5 * width - 0.5 - camera["cx"], 0.5 * height - 0.5 - camera["cy"]]
        model.cam_intrinsic[0] = np.array([camera["fx"], camera["fy"], *shift]) * 1e-5
        data.cam_xpos[0] = position
        data.cam_xmat[0] = (rotation(quaternion) @ np.diag([1.0, -1.0, -1.0])).ravel()

    def cast(self, data, position, quaternion, camera: dict) -> tuple[np.ndarray, np.ndarray]:
        """Depth and geoms, -1 for none, by rays."""
        ahead = rays(camera)
        shape, length = ahead.shape[:2], np.linalg.norm(ahead, axis=-1)
        ways = (ahead / length[..., None]).reshape(-1, 3) @ rotation(quaternion).T
        count = len(ways)
        geoms, distance = np.full(count, -1, np.int32), np.zeros(count)
        groups = np.zeros(6, np.uint8)
        groups[[PANELS, OBJECTS]] = 1
        eye = np.asarray(position, float)
        mujoco.mj_multiRay(
            self.model, data, eye, np.ascontiguousarray(ways).ravel(), groups, True, -1, geoms, distance, None, count, 10.0
        )
        return distance.reshape(shape) / length, geoms.reshape(shape)
