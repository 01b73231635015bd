//! `notifications.toml`: who gets which notices, with the line of every mistake.

use crate::notice::{NoticeKind, one_line};
use crate::secret::{Secret, check_private, read_secret};
use crate::target::{EmailTarget, MqttTarget, Security, Target, TargetAddress, WebhookTarget};
use palpate_protocols::file::ProtocolProblem;
use palpate_protocols::file::problem::{Problems, suggestion};
use palpate_protocols::file::tree::{self, DocumentNode, DocumentTable, DocumentValue};
use std::collections::BTreeSet;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use thiserror::Error;
use url::Url;

/// Name of the file in the library.
pub const SETTINGS_FILE: &str = "notifications.toml";

/// Version of the file that is read.
pub const SETTINGS_VERSION: u32 = 1;

/// The key of its first line.
const VERSION_KEY: &str = "palpate-notifications";

/// Targets of a file: each is a task with a connection of its own.
const TARGETS_MAX: usize = 16;

/// Who gets which notices.
#[derive(Clone, Debug, Default)]
pub struct NotificationSettings {
    pub targets: Vec<Target>,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SettingsError {
    #[error("{0}")]
    Unreadable(String),
    #[error("{SETTINGS_FILE}, {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Mistakes(Vec<ProtocolProblem>),
}

impl NotificationSettings {
    /// The settings of a library; `None` where it has no file.
    pub fn of_library(library: &Path) -> Result<Option<Self>, SettingsError> {
        let path = library.join(SETTINGS_FILE);
        if !path.exists() {
            return Ok(None);
        }
        // The address of a chat's webhook is a secret itself.
        check_private(&path).map_err(|err| SettingsError::Unreadable(err.to_string()))?;
        let text = palpate_sessions::text::read(&path).map_err(SettingsError::Unreadable)?;
        Self::parse(&text, library).map(Some)
    }

    /// Reads a text; files that it names are in `folder` where their paths are relative.
    pub fn parse(text: &str, folder: &Path) -> Result<Self, SettingsError> {
        let root = tree::read(text).map_err(|problem| SettingsError::Mistakes(vec![problem]))?;
        let mut reader = Reader {
            folder: folder.to_owned(),
            problems: Problems::default(),
            targets: Vec::new(),
        };
        reader.root(&root);
        match reader.problems.has_errors() {
            true => Err(SettingsError::Mistakes(reader.problems.into_list())),
            false => Ok(Self { targets: reader.targets }),
        }
    }

    /// What is sent where, a line for each target.
    #[must_use]
    pub fn text(&self) -> String {
        let line = |target: &Target| {
            let to = match target.recipients().join(", ").as_str() {
                "" => String::new(),
                people => format!(" to {people}"),
            };
            format!("{}{to}: {}", target.name(), target.rules_text())
        };
        match self.targets.as_slice() {
            [] => format!("{SETTINGS_FILE} names no target, so nothing is sent"),
            targets => targets.iter().map(line).collect::<Vec<_>>().join("\n"),
        }
    }
}

/// Reads a table of a target; its entry names the mistakes.
type ReadTarget = fn(&mut Reader, &DocumentTable) -> Option<TargetAddress>;

const TABLES: [(&str, &[&str], ReadTarget); 3] = [
    ("webhook", &["url", "token_file", "ca_file", "when"], Reader::webhook),
    (
        "email",
        &["server", "port", "security", "user", "password_file", "ca_file", "from", "to", "when"],
        Reader::email,
    ),
    (
        "mqtt",
        &["server", "port", "topic", "tls", "user", "password_file", "ca_file", "when"],
        Reader::mqtt,
    ),
];

struct Reader {
    folder: PathBuf,
    problems: Problems,
    targets: Vec<Target>,
}

impl Reader {
    fn root(&mut self, root: &DocumentTable) {
        let version = root.get(VERSION_KEY);
        if version.map(|node| &node.value)
            != Some(&DocumentValue::Number(SETTINGS_VERSION.to_string()))
        {
            self.problems.error(
                version.map_or(1, |node| node.line),
                format!("the file says {VERSION_KEY} = {SETTINGS_VERSION} on its first line; add that, or use a palpate that reads its version"),
            );
        }
        for entry in root.entries.iter().filter(|entry| entry.key != VERSION_KEY) {
            match TABLES.iter().find(|(name, ..)| *name == entry.key) {
                Some((name, keys, read)) => self.tables(&entry.node, name, keys, *read),
                None => {
                    let known = [VERSION_KEY, "webhook", "email", "mqtt"];
                    let hint = suggestion(&entry.key, &known);
                    let message = format!("'{}' is not a key of this file; {hint}", entry.key);
                    self.problems.error(entry.line, message);
                }
            }
        }
        if self.targets.len() > TARGETS_MAX {
            let count = self.targets.len();
            self.problems.error(0, format!("{count} targets are too many; keep {TARGETS_MAX}"));
        }
    }

    fn tables(&mut self, node: &DocumentNode, name: &str, keys: &[&str], read: ReadTarget) {
        let wrong = format!("'{name}' is not a list of targets; begin each with [[{name}]]");
        let DocumentValue::List(items) = &node.value else {
            return self.problems.error(node.line, wrong);
        };
        for item in items {
            let DocumentValue::Table(table) = &item.value else {
                self.problems.error(item.line, wrong.clone());
                continue;
            };
            for entry in table.entries.iter().filter(|entry| !keys.contains(&entry.key.as_str())) {
                let hint = suggestion(&entry.key, keys);
                let message = format!("[[{name}]] has no key '{}'; {hint}", entry.key);
                self.problems.error(entry.line, message);
            }
            let when = self.when(table);
            let ca_file = self.certificates(table);
            let before = self.problems.count();
            if let Some(address) = read(self, table).filter(|_| self.problems.count() == before) {
                self.targets.push(Target { address, when, ca_file });
            }
        }
    }

    fn webhook(&mut self, table: &DocumentTable) -> Option<TargetAddress> {
        let (url, line) = self.required(table, "url")?;
        let wrong = "url is not an address of the web; write https:// and the name of a server";
        let parsed = Url::parse(&url).ok().filter(|url| url.has_host());
        let Some(url) = parsed.filter(|url| ["https", "http"].contains(&url.scheme())) else {
            self.problems.error(line, wrong);
            return None;
        };
        if !url.username().is_empty() || url.password().is_some() {
            self.problems.error(
                line,
                "url has a password in it; write it into a file and name that as token_file",
            );
        }
        let token = self.secret(table, "token_file");
        if token.is_some() && url.scheme() == "http" && !is_loopback(url.host_str().unwrap_or("")) {
            self.problems
                .error(line, "a token would be sent without encryption; write https:// in url");
        }
        Some(TargetAddress::Webhook(WebhookTarget { url, token }))
    }

    fn email(&mut self, table: &DocumentTable) -> Option<TargetAddress> {
        let security = self.security(table);
        let usual = match security {
            Some(Security::Tls) | None => 465,
            Some(Security::StartTls) => 587,
            Some(Security::None) => 25,
        };
        let server = self.server(table);
        let port = self.port(table, usual);
        let login = self.login(table, security != Some(Security::None));
        let from = self.required(table, "from").and_then(|one| self.mailbox("from", &one));
        let to = self.recipients(table);
        Some(TargetAddress::Email(EmailTarget {
            server: server?,
            port: port?,
            security: security?,
            login: login?,
            from: from?,
            to: to?,
        }))
    }

    fn mqtt(&mut self, table: &DocumentTable) -> Option<TargetAddress> {
        let is_encrypted = self.flag(table, "tls").unwrap_or(true);
        let server = self.server(table);
        let port = self.port(table, if is_encrypted { 8883 } else { 1883 });
        let login = self.login(table, is_encrypted);
        let topic = self.required(table, "topic").and_then(|(topic, line)| {
            // MQTT 3.1.1, section 4.7: the name of a topic has no wildcard.
            let is_plain = !topic.contains(['#', '+']) && !topic.contains(char::is_control);
            let is_right = is_plain && topic.len() <= 200 && !topic.ends_with('/');
            if !is_right {
                self.problems.error(line, "topic has '#', '+', a control character or a last '/', or is longer than 200 bytes; write a name such as laboratory/palpate");
            }
            is_right.then_some(topic)
        });
        Some(TargetAddress::Mqtt(MqttTarget {
            server: server?,
            port: port?,
            is_encrypted,
            login: login?,
            topic: topic?,
        }))
    }

    /// The rules of a target; without any it gets every notice.
    fn when(&mut self, table: &DocumentTable) -> BTreeSet<NoticeKind> {
        let all = BTreeSet::from(NoticeKind::RULES);
        let Some(node) = table.get("when") else { return all };
        let words = NoticeKind::RULES.map(NoticeKind::name);
        let wrong =
            format!("when is not a list of rules; write when = [\"{}\"]", words.join("\", \""));
        let DocumentValue::List(items) = &node.value else {
            self.problems.error(node.line, wrong);
            return all;
        };
        if items.is_empty() {
            self.problems
                .error(node.line, "when is an empty list; name a rule, or remove the target");
        }
        let mut kinds = BTreeSet::new();
        for item in items {
            match &item.value {
                DocumentValue::Text(word) => {
                    match NoticeKind::RULES.into_iter().find(|kind| kind.name() == word) {
                        Some(kind) => _ = kinds.insert(kind),
                        None => self.problems.error(
                            item.line,
                            format!("'{word}' is not a rule; {}", suggestion(word, &words)),
                        ),
                    }
                }
                _ => self.problems.error(item.line, wrong.clone()),
            }
        }
        kinds
    }

    fn text(&mut self, table: &DocumentTable, key: &str) -> Option<(String, u32)> {
        let node = table.get(key)?;
        match &node.value {
            DocumentValue::Text(text) if !text.trim().is_empty() => Some((text.clone(), node.line)),
            _ => {
                self.problems.error(node.line, format!("{key} is not a text; write it in quotes"));
                None
            }
        }
    }

    fn required(&mut self, table: &DocumentTable, key: &str) -> Option<(String, u32)> {
        if table.get(key).is_none() {
            self.problems.error(table.line, format!("this target has no {key}; add it"));
        }
        self.text(table, key)
    }

    fn flag(&mut self, table: &DocumentTable, key: &str) -> Option<bool> {
        let node = table.get(key)?;
        match node.value {
            DocumentValue::Flag(flag) => Some(flag),
            _ => {
                let message = format!("{key} is not true or false; write it without quotes");
                self.problems.error(node.line, message);
                None
            }
        }
    }

    fn server(&mut self, table: &DocumentTable) -> Option<String> {
        let (name, line) = self.required(table, "server")?;
        let is_name = |letter: char| letter.is_ascii_alphanumeric() || "-._:".contains(letter);
        if name.chars().all(is_name) && (name.parse::<IpAddr>().is_ok() || !name.contains(':')) {
            return Some(name);
        }
        self.problems.error(line, "server is not the name or the address of a server; write it without a scheme and a port");
        None
    }

    fn port(&mut self, table: &DocumentTable, usual: u16) -> Option<u16> {
        let Some(node) = table.get("port") else { return Some(usual) };
        let port = match &node.value {
            DocumentValue::Number(text) => text.parse().ok().filter(|port| *port > 0),
            _ => None,
        };
        if port.is_none() {
            self.problems
                .error(node.line, "port is not a number from 1 to 65535; write it without quotes");
        }
        port
    }

    fn security(&mut self, table: &DocumentTable) -> Option<Security> {
        let (word, line) = self.required(table, "security")?;
        let found = Security::ALL.into_iter().find(|one| one.name() == word);
        if found.is_none() {
            let words = Security::ALL.map(Security::name);
            let hint = suggestion(&word, &words);
            self.problems.error(line, format!("security is '{word}'; {hint}"));
        }
        found
    }

    /// User and password: both or neither, and not without encryption to another computer.
    fn login(
        &mut self,
        table: &DocumentTable,
        is_encrypted: bool,
    ) -> Option<Option<(String, Secret)>> {
        let user = self.text(table, "user");
        let password = self.secret(table, "password_file");
        let line =
            table.get("user").or(table.get("password_file")).map_or(table.line, |node| node.line);
        if table.get("user").is_some() != table.get("password_file").is_some() {
            self.problems
                .error(line, "user and password_file belong together; add the one that is missing");
            return None;
        }
        let Some((user, _)) = user else { return Some(None) };
        let server = table.get("server").map(|node| &node.value);
        let is_near = matches!(server, Some(DocumentValue::Text(name)) if is_loopback(name));
        if !is_encrypted && !is_near {
            self.problems.error(line, "a password would be sent without encryption; turn encryption on (security = \"starttls\" for e-mail, tls = true for MQTT)");
            return None;
        }
        Some(Some((user, password?)))
    }

    fn mailbox(
        &mut self,
        key: &str,
        (text, line): &(String, u32),
    ) -> Option<lettre::message::Mailbox> {
        let parsed = text.parse().ok();
        let text = one_line(text);
        if parsed.is_none() {
            self.problems.error(
                *line,
                format!("{key}: '{text}' is not an e-mail address; write NAME@SERVER"),
            );
        }
        parsed
    }

    fn recipients(&mut self, table: &DocumentTable) -> Option<Vec<lettre::message::Mailbox>> {
        let node = table.get("to");
        let mut all = Vec::new();
        match node.map(|node| &node.value) {
            Some(DocumentValue::List(items)) if !items.is_empty() => {
                for item in items {
                    match &item.value {
                        DocumentValue::Text(text) => {
                            all.extend(self.mailbox("to", &(text.clone(), item.line)));
                        }
                        _ => self.problems.error(
                            item.line,
                            "to has something that is not a text; write every address in quotes",
                        ),
                    }
                }
            }
            Some(DocumentValue::Text(_)) | None => {
                let one = self.required(table, "to")?;
                all.extend(self.mailbox("to", &one));
            }
            Some(_) => {
                let line = node.map_or(table.line, |node| node.line);
                self.problems.error(line, "to names no address; write to = [\"NAME@SERVER\"]");
            }
        }
        Some(all)
    }

    fn path(&mut self, table: &DocumentTable, key: &str) -> Option<(PathBuf, u32)> {
        let (text, line) = self.text(table, key)?;
        Some((self.folder.join(text), line))
    }

    fn secret(&mut self, table: &DocumentTable, key: &str) -> Option<Secret> {
        let (path, line) = self.path(table, key)?;
        self.problems.take(line, read_secret(&path).map_err(|err| format!("{key}: {err}")))
    }

    /// The certificates that are trusted instead of the computer's.
    fn certificates(&mut self, table: &DocumentTable) -> Option<Vec<u8>> {
        let (path, line) = self.path(table, "ca_file")?;
        let read = std::fs::read(&path)
            .map_err(|err| format!("{} cannot be read ({err})", path.display()))
            .and_then(|pem| crate::tls::authorities(&pem).map(|_| pem));
        self.problems.take(
            line,
            read.map_err(|err| format!("ca_file: {err}; name a file of certificates in PEM form")),
        )
    }
}

/// Whether a server is this computer itself.
pub(crate) fn is_loopback(server: &str) -> bool {
    let plain = server.trim_start_matches('[').trim_end_matches(']');
    plain.eq_ignore_ascii_case("localhost")
        || plain.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
