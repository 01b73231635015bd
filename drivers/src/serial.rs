//! Lists the serial ports of this computer. Listing opens no port and so disturbs no rig.

use serialport::{SerialPortInfo, SerialPortType};
use thiserror::Error;

/// A serial port as the operating system shows it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PortInfo {
    /// The name by which the port is opened, such as `/dev/ttyUSB0` or `COM3`.
    pub name: String,
    /// What is behind it, in words, such as `USB 0403:6001, FTDI FT232R`.
    pub description: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SerialError {
    #[error(
        "the serial ports of this computer cannot be listed ({detail}); check the permissions of this account and try again"
    )]
    Listing { detail: String },
}

/// The serial ports of this computer in order of their names; empty when there are none.
pub fn list_ports() -> Result<Vec<PortInfo>, SerialError> {
    let ports = serialport::available_ports()
        .map_err(|err| SerialError::Listing { detail: err.to_string() })?;
    let mut ports: Vec<PortInfo> = ports.into_iter().map(describe_port).collect();
    ports.sort();
    Ok(ports)
}

fn describe_port(port: SerialPortInfo) -> PortInfo {
    let description = match port.port_type {
        SerialPortType::UsbPort(usb) => {
            let mut words = vec![format!("USB {:04x}:{:04x}", usb.vid, usb.pid)];
            words.extend([usb.manufacturer, usb.product].into_iter().flatten());
            words.extend(usb.serial_number.map(|number| format!("no. {number}")));
            words.join(", ")
        }
        SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
        SerialPortType::PciPort => "built in".to_owned(),
        SerialPortType::Unknown => "unknown kind".to_owned(),
    };
    PortInfo { name: port.port_name, description }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::UsbPortInfo;

    #[test]
    fn description_of_a_usb_port_has_its_manufacturer() {
        let port = describe_port(SerialPortInfo {
            port_name: "/dev/ttyUSB0".to_owned(),
            port_type: SerialPortType::UsbPort(UsbPortInfo {
                vid: 0x0403,
                pid: 0x6001,
                serial_number: Some("A12".to_owned()),
                manufacturer: Some("FTDI".to_owned()),
                product: None,
            }),
        });
        assert_eq!(port.name, "/dev/ttyUSB0");
        assert_eq!(port.description, "USB 0403:6001, FTDI, no. A12");
    }
}
