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
        /// Thinned samples, one message each, for programs that plot messages.
        View = "/daq/view",
        /// Marks a segment that rewrites what the segments before may have lost.
        Rewrite = "/rewrite",
        /// Bytes exchanged with devices.
        Raw = "/raw",
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

    /// The message's name without the package, and its schema.
    fn definition(self) -> (&'static str, Schema) {
        const NOW: &[(&str, &str)] = &[("now_ns", "ns since session start")];
        const END: &[(&str, &str)] = &[("ended_at", "ns since session start"), ("time_use", "s")];
        const HEALTH: &[(&str, &str)] = &[
            ("now_ns", "ns since session start"),
            ("lateness_s", "s"),
            ("sync_s", "s"),
            ("free_bytes", "bytes"),
            ("shift_s", "s"),
        ];
        match self {
            Self::Manifest => ("Manifest", Schema::Json(MANIFEST_SCHEMA, &[])),
            Self::Daq => ("DaqBlock", Schema::Protobuf(DAQ_FIELDS)),
            Self::Derived => ("DerivedBlock", Schema::Protobuf(DERIVED_FIELDS)),
            Self::Input | Self::Decision | Self::Fit => ("Entry", Schema::Json(ENTRY_SCHEMA, NOW)),
            Self::End => ("EndRecord", Schema::Json(END_SCHEMA, END)),
            Self::View => ("View", Schema::Protobuf(VIEW_FIELDS)),
            Self::Rewrite => ("Rewrite", Schema::Json(REWRITE_SCHEMA, &[])),
            Self::Raw => ("RawBlock", Schema::Protobuf(RAW_FIELDS)),
            Self::Health => ("Health", Schema::Json(HEALTH_SCHEMA, HEALTH)),
        }
    }

    /// The encodings of messages and of the schema.
    pub fn encodings(self) -> (&'static str, &'static str) {
        match self.definition().1 {
            Schema::Protobuf(_) => ("protobuf", "protobuf"),
            Schema::Json(..) => ("json", "jsonschema"),
        }
    }

    pub fn schema_name(self) -> String {
        format!("palpate.{}", self.definition().0)
    }

    pub fn schema(self) -> Vec<u8> {
        match self.definition() {
            (name, Schema::Protobuf(fields)) => descriptor_set(name, fields, |_| false),
            (_, Schema::Json(schema, _)) => schema.into(),
        }
    }

    /// Units of the channel's fields.
    pub fn metadata(self) -> BTreeMap<String, String> {
        match self.definition().1 {
            Schema::Protobuf(fields) => unit_metadata(fields.iter().map(|one| (one.0, one.4))),
            Schema::Json(_, units) => unit_metadata(units.iter().copied()),
        }
    }
}

/// Fields of a message, or a JSON Schema with the units of its fields.
enum Schema {
    Protobuf(&'static [Field]),
    Json(&'static str, &'static [(&'static str, &'static str)]),
}

fn unit_metadata(
    units: impl Iterator<Item = (&'static str, &'static str)>,
) -> BTreeMap<String, String> {
    let known = units.filter(|(_, unit)| !unit.is_empty());
    known.map(|(field, unit)| (format!("unit.{field}"), unit.to_owned())).collect()
}

/// Topic of an export of one message per sample.
pub const SAMPLE_TOPIC: &str = "/sample";

/// Descriptor of a sample's message, in which unknown values are absent.
pub fn sample_schema() -> Vec<u8> {
    let always = ["t_s", "phase", "cycle", "sample"];
    descriptor_set("Sample", SAMPLE_FIELDS, |name| !always.contains(&name))
}

pub fn sample_metadata() -> BTreeMap<String, String> {
    unit_metadata(SAMPLE_FIELDS.iter().map(|one| (one.0, one.4)))
}

/// Name, number, label, type and unit.
type Field = (&'static str, i32, Label, Type, &'static str);

const DAQ_FIELDS: &[Field] = &[
    ("first_sample", 1, Label::Optional, Type::Uint64, ""),
    ("tick_delta", 2, Label::Repeated, Type::Sint64, "controller clock counts"),
    ("host_delta_ns", 3, Label::Repeated, Type::Sint64, "ns"),
    ("counts", 4, Label::Repeated, Type::Sint32, "1"),
    ("volts", 5, Label::Repeated, Type::Double, "V"),
    ("pulses_delta", 6, Label::Repeated, Type::Sint64, "pulses"),
    ("status", 7, Label::Repeated, Type::Uint32, "bits"),
    ("age_ns", 8, Label::Repeated, Type::Uint64, "ns"),
    ("age_within_ns", 9, Label::Repeated, Type::Uint64, "ns"),
];

const DERIVED_FIELDS: &[Field] = &[
    ("first_sample", 1, Label::Optional, Type::Uint64, ""),
    ("force_newtons", 2, Label::Repeated, Type::Double, "N"),
    ("depth_mm", 3, Label::Repeated, Type::Double, "mm"),
    ("validity", 4, Label::Repeated, Type::Uint32, "bits: 1 force, 2 depth"),
    ("phase", 5, Label::Repeated, Type::Uint32, "code"),
    ("cycle", 6, Label::Repeated, Type::Uint32, "1"),
];

const VIEW_FIELDS: &[Field] = &[
    ("t_s", 1, Label::Optional, Type::Double, "s since session start"),
    ("signal_V", 2, Label::Optional, Type::Double, "V"),
    ("force_N", 3, Label::Optional, Type::Double, "N"),
    ("depth_mm", 4, Label::Optional, Type::Double, "mm"),
    ("cycle", 5, Label::Optional, Type::Uint32, ""),
];

const RAW_FIELDS: &[Field] = &[
    ("first_byte", 1, Label::Optional, Type::Uint64, "bytes"),
    ("device", 2, Label::Optional, Type::String, ""),
    ("at_delta_ns", 3, Label::Repeated, Type::Sint64, "ns since session start"),
    ("is_sent", 4, Label::Repeated, Type::Bool, ""),
    ("length", 5, Label::Repeated, Type::Uint32, "bytes"),
    ("data", 6, Label::Optional, Type::Bytes, ""),
];

const SAMPLE_FIELDS: &[Field] = &[
    ("t_s", 1, Label::Optional, Type::Double, "s since the first sample"),
    ("depth_mm", 2, Label::Optional, Type::Double, "mm"),
    ("force_N", 3, Label::Optional, Type::Double, "N"),
    ("signal_V", 4, Label::Optional, Type::Double, "V"),
    ("counts", 5, Label::Optional, Type::Sint32, "1"),
    ("pulses", 6, Label::Optional, Type::Sint64, "1"),
    ("phase", 7, Label::Optional, Type::String, ""),
    ("cycle", 8, Label::Optional, Type::Uint32, "1"),
    ("sample", 9, Label::Optional, Type::Uint64, "1"),
];

/// A field that may be absent is in its own `oneof`, as proto3 encodes `optional`.
fn descriptor_set(
    message: &str,
    fields: &[Field],
    may_be_absent: impl Fn(&str) -> bool,
) -> Vec<u8> {
    let absent: Vec<&str> =
        fields.iter().map(|(name, ..)| *name).filter(|name| may_be_absent(name)).collect();
    let oneof_of = |name: &str| absent.iter().position(|one| *one == name);
    let field = |&(name, number, label, kind, _): &Field| FieldDescriptorProto {
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

    /// Wire format by the descriptor: packed arrays and plain varints.
    fn described(fields: &[Field]) -> Vec<(u32, WireType)> {
        fields
            .iter()
            .map(|&(_, number, label, kind, _)| match (label, kind) {
                (Label::Repeated, _) | (_, Type::String | Type::Bytes) => {
                    (number as u32, WireType::LengthDelimited)
                }
                _ => (number as u32, WireType::Varint),
            })
            .collect()
    }

    #[test]
    fn descriptors_match_the_encoded_messages() {
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
        assert_eq!(wire_fields(&daq.encode_to_vec()), described(DAQ_FIELDS));
        let derived = DerivedBlock {
            first_sample: 1,
            force_newtons: vec![1.0],
            depth_mm: vec![1.0],
            validity: vec![1],
            phase: vec![1],
            cycle: vec![1],
        };
        assert_eq!(wire_fields(&derived.encode_to_vec()), described(DERIVED_FIELDS));
        let raw = RawMessage {
            first_byte: 1,
            device: "a".into(),
            at_delta_ns: vec![1],
            is_sent: vec![true],
            length: vec![1],
            data: vec![1],
        };
        assert_eq!(wire_fields(&raw.encode_to_vec()), described(RAW_FIELDS));
        // Rust fields have the described names.
        let shown = format!("{daq:?} {derived:?} {raw:?}");
        let fields = DAQ_FIELDS.iter().chain(DERIVED_FIELDS).chain(RAW_FIELDS);
        for (name, ..) in fields {
            assert!(shown.contains(&format!("{name}:")), "{name}");
        }
    }

    #[test]
    fn schemas_parse_as_their_declared_kind() {
        for channel in Channel::ALL {
            assert_eq!(Channel::from_topic(channel.name()), Some(channel));
            let schema = channel.schema();
            if channel.encodings().1 == "protobuf" {
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
