//! The channels of a session log and the schemas that let other programs read it.
//!
//! Schemas follow the MCAP registry (<https://mcap.dev/spec/registry>): a serialised
//! `FileDescriptorSet` for Protocol Buffers, a JSON Schema for JSON.

use crate::record::EntryKind;
use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
    OneofDescriptorProto,
};
use std::collections::BTreeMap;

palpate_model::named! {
    /// A channel of a session log.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum Channel {
        Manifest = "/manifest",
        Daq = "/daq/block",
        Derived = "/derived/block",
        Input = "/input",
        Decision = "/decision",
        Fit = "/fit",
        End = "/end",
        /// The samples thinned out, one message each, for programs that draw messages.
        View = "/daq/view",
        /// Says that what may be lost of the segments before is written again in this one.
        Rewrite = "/rewrite",
        /// Bytes as exchanged with devices.
        Raw = "/raw",
        /// How the computer kept up, and its clocks.
        Health = "/health",
    }
}

impl Channel {
    pub fn from_topic(topic: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|one| one.name() == topic)
    }

    pub fn of_entry(kind: EntryKind) -> Self {
        match kind {
            EntryKind::Input => Self::Input,
            EntryKind::Decision => Self::Decision,
            EntryKind::Fit => Self::Fit,
        }
    }

    /// The encoding of messages, and so of the schema: `protobuf` or `json`.
    pub fn message_encoding(self) -> &'static str {
        match self {
            Self::Daq | Self::Derived | Self::View | Self::Raw => "protobuf",
            _ => "json",
        }
    }

    pub fn schema_encoding(self) -> &'static str {
        match self {
            Self::Daq | Self::Derived | Self::View | Self::Raw => "protobuf",
            _ => "jsonschema",
        }
    }

    pub fn schema_name(self) -> &'static str {
        match self {
            Self::Manifest => "palpate.Manifest",
            Self::Daq => "palpate.DaqBlock",
            Self::Derived => "palpate.DerivedBlock",
            Self::Input | Self::Decision | Self::Fit => "palpate.Entry",
            Self::End => "palpate.EndRecord",
            Self::View => "palpate.View",
            Self::Rewrite => "palpate.Rewrite",
            Self::Raw => "palpate.RawBlock",
            Self::Health => "palpate.Health",
        }
    }

    pub fn schema(self) -> Vec<u8> {
        match self {
            Self::Daq => descriptor_set("DaqBlock", DAQ_FIELDS),
            Self::Derived => descriptor_set("DerivedBlock", DERIVED_FIELDS),
            Self::Manifest => MANIFEST_SCHEMA.into(),
            Self::Input | Self::Decision | Self::Fit => ENTRY_SCHEMA.into(),
            Self::End => END_SCHEMA.into(),
            Self::View => descriptor_set("View", VIEW_FIELDS),
            Self::Rewrite => REWRITE_SCHEMA.into(),
            Self::Raw => descriptor_set("RawBlock", RAW_FIELDS),
            Self::Health => HEALTH_SCHEMA.into(),
        }
    }

    /// Units of the channel's fields.
    pub fn metadata(self) -> BTreeMap<String, String> {
        let units: &[(&str, &str)] = match self {
            Self::Daq => &[
                ("tick_delta", "controller clock counts"),
                ("host_delta_ns", "ns"),
                ("counts", "1"),
                ("volts", "V"),
                ("pulses_delta", "pulses"),
                ("status", "bits"),
                ("age_ns", "ns"),
                ("age_within_ns", "ns"),
            ],
            Self::Derived => &[
                ("force_newtons", "N"),
                ("depth_mm", "mm"),
                ("validity", "bits: 1 force, 2 depth"),
                ("phase", "code"),
                ("cycle", "1"),
            ],
            Self::Input | Self::Decision | Self::Fit => &[("now_ns", "ns since session start")],
            Self::End => &[("ended_at", "ns since session start"), ("time_use", "s")],
            Self::View => &[
                ("t_s", "s since session start"),
                ("signal_V", "V"),
                ("force_N", "N"),
                ("depth_mm", "mm"),
            ],
            Self::Raw => &[
                ("first_byte", "bytes"),
                ("at_delta_ns", "ns since session start"),
                ("length", "bytes"),
            ],
            Self::Health => &[
                ("now_ns", "ns since session start"),
                ("lateness_s", "s"),
                ("sync_s", "s"),
                ("free_bytes", "bytes"),
                ("shift_s", "s"),
            ],
            Self::Manifest | Self::Rewrite => &[],
        };
        units.iter().map(|(field, unit)| (format!("unit.{field}"), (*unit).to_owned())).collect()
    }
}

/// Topic of an export of one message per sample.
pub const SAMPLE_TOPIC: &str = "/sample";

/// Descriptor of its messages, where what is unknown is told apart from 0.
pub fn sample_schema() -> Vec<u8> {
    let always = ["t_s", "phase", "cycle", "sample"];
    descriptor_set_with("Sample", SAMPLE_FIELDS, |name| !always.contains(&name))
}

/// Units of its fields.
pub fn sample_metadata() -> BTreeMap<String, String> {
    let units = [
        ("t_s", "s since the first sample"),
        ("depth_mm", "mm"),
        ("force_N", "N"),
        ("signal_V", "V"),
        ("counts", "1"),
        ("pulses", "1"),
        ("cycle", "1"),
        ("sample", "1"),
    ];
    let pairs = units.map(|(field, unit)| (format!("unit.{field}"), unit.to_owned()));
    pairs.into()
}

type Field = (&'static str, i32, Label, Type);

const DAQ_FIELDS: &[Field] = &[
    ("first_sample", 1, Label::Optional, Type::Uint64),
    ("tick_delta", 2, Label::Repeated, Type::Sint64),
    ("host_delta_ns", 3, Label::Repeated, Type::Sint64),
    ("counts", 4, Label::Repeated, Type::Sint32),
    ("volts", 5, Label::Repeated, Type::Double),
    ("pulses_delta", 6, Label::Repeated, Type::Sint64),
    ("status", 7, Label::Repeated, Type::Uint32),
    ("age_ns", 8, Label::Repeated, Type::Uint64),
    ("age_within_ns", 9, Label::Repeated, Type::Uint64),
];

const DERIVED_FIELDS: &[Field] = &[
    ("first_sample", 1, Label::Optional, Type::Uint64),
    ("force_newtons", 2, Label::Repeated, Type::Double),
    ("depth_mm", 3, Label::Repeated, Type::Double),
    ("validity", 4, Label::Repeated, Type::Uint32),
    ("phase", 5, Label::Repeated, Type::Uint32),
    ("cycle", 6, Label::Repeated, Type::Uint32),
];

const VIEW_FIELDS: &[Field] = &[
    ("t_s", 1, Label::Optional, Type::Double),
    ("signal_V", 2, Label::Optional, Type::Double),
    ("force_N", 3, Label::Optional, Type::Double),
    ("depth_mm", 4, Label::Optional, Type::Double),
    ("cycle", 5, Label::Optional, Type::Uint32),
];

const RAW_FIELDS: &[Field] = &[
    ("first_byte", 1, Label::Optional, Type::Uint64),
    ("device", 2, Label::Optional, Type::String),
    ("at_delta_ns", 3, Label::Repeated, Type::Sint64),
    ("is_sent", 4, Label::Repeated, Type::Bool),
    ("length", 5, Label::Repeated, Type::Uint32),
    ("data", 6, Label::Optional, Type::Bytes),
];

const SAMPLE_FIELDS: &[Field] = &[
    ("t_s", 1, Label::Optional, Type::Double),
    ("depth_mm", 2, Label::Optional, Type::Double),
    ("force_N", 3, Label::Optional, Type::Double),
    ("signal_V", 4, Label::Optional, Type::Double),
    ("counts", 5, Label::Optional, Type::Sint32),
    ("pulses", 6, Label::Optional, Type::Sint64),
    ("phase", 7, Label::Optional, Type::String),
    ("cycle", 8, Label::Optional, Type::Uint32),
    ("sample", 9, Label::Optional, Type::Uint64),
];

fn descriptor_set(message: &str, fields: &[Field]) -> Vec<u8> {
    descriptor_set_with(message, fields, |_| false)
}

/// A field that may be absent is in a `oneof` of its own, as the language's `optional` is described.
fn descriptor_set_with(
    message: &str,
    fields: &[Field],
    may_be_absent: impl Fn(&str) -> bool,
) -> Vec<u8> {
    let absent: Vec<&str> =
        fields.iter().map(|(name, ..)| *name).filter(|name| may_be_absent(name)).collect();
    let oneof_of = |name: &str| absent.iter().position(|one| *one == name);
    let field = |&(name, number, label, kind): &Field| FieldDescriptorProto {
        name: Some(name.into()),
        oneof_index: oneof_of(name).map(|index| index as i32),
        proto3_optional: oneof_of(name).map(|_| true),
        number: Some(number),
        label: Some(label.into()),
        r#type: Some(kind.into()),
        json_name: Some(name.into()),
        ..Default::default()
    };
    let file = FileDescriptorProto {
        name: Some(format!("palpate/{message}.proto")),
        package: Some("palpate".into()),
        syntax: Some("proto3".into()),
        message_type: vec![DescriptorProto {
            name: Some(message.into()),
            field: fields.iter().map(field).collect(),
            oneof_decl: absent
                .iter()
                .map(|name| OneofDescriptorProto {
                    name: Some(format!("_{name}")),
                    ..Default::default()
                })
                .collect(),
            ..Default::default()
        }],
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

const MANIFEST_SCHEMA: &str = r#"{"type":"object","properties":{"record_version":{"type":"integer"},"session_id":{"type":"string"},"software_version":{"type":"string"},"engine_version":{"type":"integer"},"started_at":{"type":"string","format":"date-time"},"operator":{"type":"string"},"specimen":{"type":"string"},"indenter":{"type":"string"},"about":{"type":"object"},"signal":{"type":"object"},"imported":{"type":"object"},"rig":{"type":"object"},"limits":{"type":"object"},"calibration":{},"plan":{},"settings":{},"acknowledgements":{"type":"array","items":{"type":"string"}}},"required":["record_version","session_id","software_version","started_at"]}"#;

const ENTRY_SCHEMA: &str = r#"{"type":"object","properties":{"order":{"type":"integer"},"after_sample":{"type":"integer"},"now_ns":{"type":"integer"},"body":{}},"required":["order","after_sample","now_ns","body"]}"#;

const END_SCHEMA: &str = r#"{"type":"object","properties":{"outcome":{"type":"string"},"reason":{"type":"string"},"samples":{"type":"integer"},"entries":{"type":"integer"},"raw_bytes":{"type":"integer"},"ended_at":{"type":"integer"},"time_use":{"type":"array","items":{"type":"array"}}},"required":["outcome","reason","samples","entries","ended_at"]}"#;

const REWRITE_SCHEMA: &str = r#"{"type":"object","properties":{"reason":{"type":"string"},"samples":{"type":"integer"},"entries":{"type":"integer"}},"required":["reason","samples","entries"]}"#;

const HEALTH_SCHEMA: &str = r#"{"type":"object","properties":{"now_ns":{"type":"integer"},"kind":{"type":"string"},"lateness_s":{"type":"number"},"queue_share":{"type":"number"},"sync_s":{"type":"number"},"free_bytes":{"type":"integer"},"missed_readings":{"type":"integer"},"why":{"type":"string"},"wall":{"type":"string","format":"date-time"},"shift_s":{"type":"number"},"text":{"type":"string"}},"required":["now_ns","kind"]}"#;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{DaqBlock, DerivedBlock};
    use crate::raw::RawMessage;
    use prost::encoding::{WireType, decode_key, decode_varint};

    /// The (number, wire type) pairs of an encoded message, in order.
    fn wire_fields(mut bytes: &[u8]) -> Vec<(u32, WireType)> {
        let mut fields = Vec::new();
        while !bytes.is_empty() {
            let (number, wire) = decode_key(&mut bytes).unwrap();
            let value = decode_varint(&mut bytes).unwrap();
            if wire == WireType::LengthDelimited {
                bytes = &bytes[value as usize..];
            }
            fields.push((number, wire));
        }
        fields
    }

    /// What a descriptor promises on the wire: packed arrays and plain varints.
    fn promised(fields: &[Field]) -> Vec<(u32, WireType)> {
        fields
            .iter()
            .map(|&(_, number, label, kind)| match (label, kind) {
                (Label::Repeated, _) | (_, Type::String | Type::Bytes) => {
                    (number as u32, WireType::LengthDelimited)
                }
                _ => (number as u32, WireType::Varint),
            })
            .collect()
    }

    #[test]
    fn descriptors_describe_what_is_written() {
        let daq = DaqBlock {
            first_sample: 1,
            tick_delta: vec![1],
            host_delta_ns: vec![1],
            counts: vec![1],
            volts: vec![1.0],
            pulses_delta: vec![1],
            status: vec![1],
            age_ns: vec![1],
            age_within_ns: vec![1],
        };
        assert_eq!(wire_fields(&daq.encode_to_vec()), promised(DAQ_FIELDS));
        let derived = DerivedBlock {
            first_sample: 1,
            force_newtons: vec![1.0],
            depth_mm: vec![1.0],
            validity: vec![1],
            phase: vec![1],
            cycle: vec![1],
        };
        assert_eq!(wire_fields(&derived.encode_to_vec()), promised(DERIVED_FIELDS));
        let raw = RawMessage {
            first_byte: 1,
            device: "a".into(),
            at_delta_ns: vec![1],
            is_sent: vec![true],
            length: vec![1],
            data: vec![1],
        };
        assert_eq!(wire_fields(&raw.encode_to_vec()), promised(RAW_FIELDS));
        // The names of the fields, as the derive macro sees them, are the names described.
        let shown = format!("{daq:?} {derived:?} {raw:?}");
        let described = DAQ_FIELDS.iter().chain(DERIVED_FIELDS).chain(RAW_FIELDS);
        for (name, ..) in described {
            assert!(shown.contains(&format!("{name}:")), "{name}");
        }
    }

    #[test]
    fn schemas_are_what_they_claim_to_be() {
        for channel in Channel::ALL {
            assert_eq!(Channel::from_topic(channel.name()), Some(channel));
            let schema = channel.schema();
            if channel.schema_encoding() == "protobuf" {
                let set = FileDescriptorSet::decode(schema.as_slice()).unwrap();
                let name = format!("palpate.{}", set.file[0].message_type[0].name());
                assert_eq!(name, channel.schema_name());
            } else {
                let value: serde_json::Value = serde_json::from_slice(&schema).unwrap();
                assert_eq!(value["type"], "object");
            }
        }
    }
}
