//! Recordings that others made: formats read into frames, and where the shelf's board is in them.
//!
//! A recording is a list of images with the poses that the camera had. Every format becomes the same list of entries
//! (`entry`); what is read of an entry is a [`Frame`](crate::camera::Frame) in the board's frame. Depth images are PNGs of
//! 16 bits or NumPy arrays; labels are PNGs or arrays of numbers, which a [`LabelMap`] turns into classes. Nothing is kept
//! in memory but the list: an image is read when it is asked for.
//!
//! | format | what it is known by | poses | depth |
//! |---|---|---|---|
//! | plain folder | `intrinsics.json`, `depth/` | `pose/NNN.txt`: 4 x 4, or x y z qx qy qz qw | units per metre in `intrinsics.json` |
//! | TUM RGB-D | `groundtruth.txt`, `depth.txt` | nearest in time | 5,000 units a metre |
//! | BOP scene | `scene_camera.json` | world to camera, millimetres | `depth_scale`, millimetres |
//! | Nerfstudio | `transforms.json` | OpenGL's axes | 1,000 units a metre |
//! | ROS 2 | a file `.mcap` | `TFMessage` or `PoseStamped` | `Image` or `CompressedImage` |

mod bag;
mod board;
mod bop;
mod cdr;
mod entry;
mod find_board;
mod flying;
mod folder;
mod image;
mod joints;
mod labels;
mod mcap_file;
mod nerf;
mod open;
mod pixels;
mod pose_text;
mod read;
mod ros;
mod ros_frames;
mod rvl;
mod settings;
mod survey;
mod topics;
mod transforms;
mod tum;

pub use board::Board;
pub use find_board::find_board;
pub use flying::EDGE_DEG;
pub(crate) use folder::pinhole as opencv_pinhole;
pub use labels::LabelMap;
pub use open::Recording;
pub(crate) use read::frame_of_files;
pub use ros_frames::{Inspection, TopicLine, inspect};
pub use settings::Settings;
pub use survey::{Fate, Row, Survey};
