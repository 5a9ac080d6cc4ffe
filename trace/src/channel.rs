//! The channels of a trace file.
//!
//! Responsible for: their names, in one place, and the schema each is published with.
//! Not responsible for: what is written to them when (`writer`, `reader`).

use std::sync::LazyLock;

use schemars::{JsonSchema, Schema, schema_for};

use crate::record::{End, Event, Gap, Mark, Motion, SceneRecord, State};

/// MCAP's name for messages in JSON.
pub(crate) const ENCODING: &str = "json";
/// MCAP's name for schemas in JSON Schema.
pub(crate) const SCHEMA_ENCODING: &str = "jsonschema";
/// Written to the file's header.
pub(crate) const PROFILE: &str = "rearrange";

/// A channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Channel {
    Scene,
    Motion,
    Event,
    State,
    Mark,
    Gap,
    End,
}

impl Channel {
    pub(crate) const ALL: [Self; 7] = [
        Self::Scene,
        Self::Motion,
        Self::Event,
        Self::State,
        Self::Mark,
        Self::Gap,
        Self::End,
    ];

    /// Its topic, and the last part of its schema's name.
    pub(crate) const fn topic(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Motion => "motion",
            Self::Event => "event",
            Self::State => "state",
            Self::Mark => "mark",
            Self::Gap => "gap",
            Self::End => "end",
        }
    }

    pub(crate) fn of_topic(topic: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|channel| channel.topic() == topic)
    }

    /// Name and JSON Schema of its records, as text. Made once: whoever writes one trace after the
    /// other would do little else.
    pub(crate) fn schema(self) -> (String, &'static str) {
        static SCHEMAS: LazyLock<[String; Channel::ALL.len()]> =
            LazyLock::new(|| Channel::ALL.map(|channel| channel.made().to_value().to_string()));
        (
            format!("{PROFILE}.{}", self.topic()),
            &SCHEMAS[self as usize],
        )
    }

    fn made(self) -> Schema {
        fn of<T: JsonSchema>() -> Schema {
            schema_for!(T)
        }
        match self {
            Self::Scene => of::<SceneRecord>(),
            Self::Motion => of::<Motion>(),
            Self::Event => of::<Event>(),
            Self::State => of::<State>(),
            Self::Mark => of::<Mark>(),
            Self::Gap => of::<Gap>(),
            Self::End => of::<End>(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Viewers take a channel's schema for the shape of a table: it must describe an object.
    #[test]
    fn every_channel_has_a_name_of_its_own_and_a_schema_of_an_object() {
        for channel in Channel::ALL {
            assert_eq!(Channel::of_topic(channel.topic()), Some(channel));
            let (name, schema) = channel.schema();
            assert_eq!(name, format!("rearrange.{}", channel.topic()));
            let schema: serde_json::Value = serde_json::from_str(schema).unwrap();
            assert_eq!(schema["type"], "object", "{name}");
            assert!(schema["properties"].is_object(), "{name}");
        }
        assert_eq!(Channel::of_topic("camera"), None);
    }
}
