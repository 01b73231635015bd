//! The keys that say where a device is.

use super::fields::Fields;
use crate::wire::DeviceAddress;

/// Reads `port`, `baud`, `handshake`, `address` and `program`, behind a table's name and a dot or nothing.
pub(super) fn read_address(fields: &mut Fields, table: &str) -> Option<DeviceAddress> {
    let key = |name: &str| format!("{table}{name}");
    if let Some(words) = fields.texts(&key("program")) {
        return Some(DeviceAddress::Program { words, folder: fields.folder().to_owned() });
    }
    let port = fields.text(&key("port"));
    let address = fields.text(&key("address"));
    let baud = fields.whole_number(&key("baud"), 300, 4_000_000);
    let has_handshake =
        fields.choice(&key("handshake"), &[("none", false), ("rts-cts", true)], Some(false));
    match (port, address) {
        (Some(port), None) => Some(DeviceAddress::Serial {
            port,
            // The factory setting of Galil boards with an USB port, and what gclib opens them with (gclib.h, `--baud`);
            // that of Grbl 1.1 (doc/markdown/interface.md), of Mark-10 stands, and of the sketch for HX711 boards.
            baud: baud.map_or(115_200, |baud| baud as u32),
            has_handshake: has_handshake?,
        }),
        (None, Some(address)) => {
            if baud.is_some() {
                fields.mistake(
                    &key("baud"),
                    "a controller on a network has no baud rate; remove this key",
                );
            }
            Some(DeviceAddress::Tcp(address))
        }
        (Some(_), Some(_)) => {
            fields.mistake(
                &key("address"),
                "a device has either a port or an address, not both; remove one of the two keys",
            );
            None
        }
        (None, None) => {
            let what = match table {
                "" => "controller",
                "cell." => "load cell",
                _ => "sensor",
            };
            fields.mistake(
                &key("port"),
                &format!(
                    "the {what} has no address; give port = \"/dev/ttyUSB0\" or address = \"192.168.1.10:23\""
                ),
            );
            None
        }
    }
}
