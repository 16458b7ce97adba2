//! A layout for the viewer, written as the blueprint store that the viewer reads.
//!
//! The SDK's own blueprint builder has no view properties (camera, grid, background, ranges), so containers, views and
//! their properties are logged here as the archetypes that they are.

use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::{archetypes as bp, components as bpc};
use rerun::external::re_sdk_types::datatypes::Uuid;
use rerun::log::LogMsg;
use rerun::{AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

/// One view: its class, what it shows, and its properties.
pub struct View {
    class: &'static str,
    name: String,
    origin: String,
    contents: Vec<String>,
    properties: Vec<(&'static str, Vec<rerun::SerializedComponentBatch>)>,
}

impl View {
    /// A view of a class of the viewer (`3D`, `2D`, `TimeSeries`, `TextDocument`, `TextLog`) at an entity, showing the
    /// entities that `contents` lists.
    pub fn new(
        class: &'static str,
        name: &str,
        origin: &str,
        contents: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        Self {
            class,
            name: name.to_owned(),
            origin: origin.to_owned(),
            contents: contents.into_iter().map(Into::into).collect(),
            properties: Vec::new(),
        }
    }

    /// With a view property, for example `EyeControls3D`.
    pub fn with(mut self, name: &'static str, property: &dyn AsComponents) -> Self {
        self.properties.push((name, property.as_serialized_batches()));
        self
    }
}

/// A part of the layout.
pub enum Part {
    /// Side by side, with shares of the width.
    Row(Vec<(f32, Part)>),
    /// One above the other, with shares of the height.
    Column(Vec<(f32, Part)>),
    /// One at a time; the first is open.
    Tabs(Vec<Part>),
    /// A view.
    View(View),
}

/// A whole layout.
pub struct Layout {
    /// What fills the window.
    pub root: Part,
}

impl Layout {
    /// Sends the layout into a recording, to be used at once and by default.
    pub fn send(&self, recording: &RecordingStream, application: &'static str) -> RecordingStreamResult<()> {
        let (stream, storage) = RecordingStreamBuilder::new(application)
            .recording_id(rerun::external::re_log_types::RecordingId::random())
            .blueprint()
            .memory()?;
        stream.set_log_time_enabled(false);
        stream.set_time_sequence("blueprint", 0);
        let mut writer = Writer { stream: &stream, next: 0 };
        let root = writer.root(&self.root)?;
        let viewport = bp::ViewportBlueprint::new()
            .with_root_container(bpc::RootContainer::from(Uuid { bytes: root }))
            .with_auto_layout(false)
            .with_auto_views(false);
        stream.log("viewport", &viewport)?;
        for panel in ["blueprint_panel", "selection_panel"] {
            stream.log(panel, &bp::PanelBlueprint::new().with_state(bpc::PanelState::Collapsed))?;
        }
        let time = bp::TimePanelBlueprint::new()
            .with_state(bpc::PanelState::Collapsed)
            .with_timeline(super::paths::TIMELINE)
            .with_fps(2.0)
            .with_play_state(bpc::PlayState::Following);
        stream.log("time_panel", &time)?;
        let messages = storage.take();
        let id = messages.iter().find_map(|message| match message {
            LogMsg::SetStoreInfo(info) => Some(info.info.store_id.clone()),
            _ => None,
        });
        if let Some(blueprint_id) = id {
            let activation = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
            recording.send_blueprint(messages, activation);
        }
        Ok(())
    }
}

struct Writer<'a> {
    stream: &'a RecordingStream,
    next: u8,
}

impl Writer<'_> {
    /// Writes the whole; returns the root container's id. A view alone gets a container around it: the viewer shows
    /// nothing at all where its root is a view.
    fn root(&mut self, part: &Part) -> RecordingStreamResult<[u8; 16]> {
        let (id, _) = match part {
            Part::View(_) => self.container(bpc::ContainerKind::Tabs, &[part], Vec::new())?,
            _ => self.part(part)?,
        };
        Ok(id)
    }

    /// Writes a part; returns its id and its path.
    fn part(&mut self, part: &Part) -> RecordingStreamResult<([u8; 16], EntityPath)> {
        let shared = |parts: &'_ [(f32, Part)]| parts.iter().map(|part| part.0).collect();
        match part {
            Part::View(view) => self.view(view),
            Part::Tabs(parts) => {
                self.container(bpc::ContainerKind::Tabs, &parts.iter().collect::<Vec<_>>(), Vec::new())
            }
            Part::Row(parts) => {
                let children: Vec<&Part> = parts.iter().map(|part| &part.1).collect();
                self.container(bpc::ContainerKind::Horizontal, &children, shared(parts))
            }
            Part::Column(parts) => {
                let children: Vec<&Part> = parts.iter().map(|part| &part.1).collect();
                self.container(bpc::ContainerKind::Vertical, &children, shared(parts))
            }
        }
    }

    fn container(
        &mut self,
        kind: bpc::ContainerKind,
        children: &[&Part],
        shares: Vec<f32>,
    ) -> RecordingStreamResult<([u8; 16], EntityPath)> {
        let id = self.id();
        let mut paths = Vec::new();
        for child in children {
            paths.push(self.part(child)?.1.to_string());
        }
        let path = EntityPath::from(format!("container/{}", hyphenated(id)));
        let mut container = bp::ContainerBlueprint::new(kind)
            .with_contents(paths.iter().map(|path| bpc::IncludedContent::from(path.as_str())));
        container = match kind {
            bpc::ContainerKind::Horizontal => container.with_col_shares(shares),
            bpc::ContainerKind::Vertical => container.with_row_shares(shares),
            _ => container.with_active_tab(paths[0].as_str()),
        };
        self.stream.log(path.clone(), &container)?;
        Ok((id, path))
    }

    fn view(&mut self, view: &View) -> RecordingStreamResult<([u8; 16], EntityPath)> {
        let id = self.id();
        let path = format!("view/{}", hyphenated(id));
        let contents =
            bp::ViewContents::new(view.contents.iter().map(|query| bpc::QueryExpression(query.as_str().into())));
        self.stream.log(format!("{path}/ViewContents"), &contents)?;
        let blueprint = bp::ViewBlueprint::new(bpc::ViewClass(view.class.into()))
            .with_display_name(view.name.as_str())
            .with_space_origin(view.origin.as_str());
        self.stream.log(path.clone(), &blueprint)?;
        for (name, property) in &view.properties {
            self.stream.log_serialized_batches(format!("{path}/{name}"), false, property.iter().cloned())?;
        }
        Ok((id, path.into()))
    }

    /// Ids that are the same in every recording, so that a layout can be compared and addressed.
    fn id(&mut self) -> [u8; 16] {
        self.next += 1;
        let mut id = *b"nudge layout v1\0";
        id[15] = self.next;
        id
    }
}

/// An id as the viewer writes it in paths: `8-4-4-4-12` hexadecimal digits.
fn hyphenated(id: [u8; 16]) -> String {
    let hex: String = id.iter().map(|byte| format!("{byte:02x}")).collect();
    [&hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]].join("-")
}

#[cfg(test)]
mod tests {
    use super::{Layout, Part, View};

    /// Every container's path that the layout's messages name.
    fn containers(root: Part) -> Vec<String> {
        let (stream, storage) = rerun::RecordingStreamBuilder::new("nudge_test").memory().expect("stream");
        Layout { root }.send(&stream, "nudge_test").expect("layout");
        let chunks = storage.take().into_iter().filter_map(|message| match message {
            super::LogMsg::ArrowMsg(_, arrow) => rerun::log::Chunk::from_arrow_msg(&arrow).ok(),
            _ => None,
        });
        let paths = chunks.map(|chunk| chunk.entity_path().to_string());
        paths.filter(|path| path.starts_with("/container/")).collect()
    }

    #[test]
    fn the_root_is_always_a_container() {
        let view = || Part::View(View::new("3D", "Belief", "/", ["/belief"]));
        assert_eq!(containers(view()).len(), 1);
        assert_eq!(containers(Part::Row(vec![(1.0, view()), (1.0, view())])).len(), 1);
    }

    #[test]
    fn ids_are_written_like_uuids() {
        assert_eq!(super::hyphenated(*b"nudge layout v1\x01"), "6e756467-6520-6c61-796f-757420763101");
    }
}
