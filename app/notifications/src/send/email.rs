//! Plain text by SMTP (RFC 5321).

use super::{ATTEMPT_MAX, SendError, with_causes};
use crate::notice::Notice;
use crate::target::{EmailTarget, Security};
use crate::tls;
use lettre::address::Envelope;
use lettre::message::Mailbox;
use lettre::message::header::ContentType;
use lettre::transport::smtp::authentication::Credentials;
use lettre::transport::smtp::client::{Certificate, CertificateStore, Tls, TlsParameters};
use lettre::{AsyncSmtpTransport, AsyncTransport, Message, Tokio1Executor};

pub(crate) struct EmailSender {
    transport: AsyncSmtpTransport<Tokio1Executor>,
    from: Mailbox,
    to: Vec<Mailbox>,
    is_login: bool,
}

impl EmailSender {
    pub fn new(target: &EmailTarget, ca_file: Option<&[u8]>) -> Result<Self, SendError> {
        let parameters = || parameters(&target.server, ca_file);
        let tls = match target.security {
            Security::Tls => Tls::Wrapper(parameters()?),
            // Required: a server that offers no encryption gets nothing.
            Security::StartTls => Tls::Required(parameters()?),
            Security::None => Tls::None,
        };
        let mut builder = AsyncSmtpTransport::<Tokio1Executor>::builder_dangerous(&target.server)
            .port(target.port)
            .tls(tls)
            .timeout(Some(ATTEMPT_MAX));
        if let Some((user, password)) = &target.login {
            let password = password.reveal().to_owned();
            builder = builder.credentials(Credentials::new(user.clone(), password));
        }
        Ok(Self {
            transport: builder.build(),
            from: target.from.clone(),
            to: target.to.clone(),
            is_login: target.login.is_some(),
        })
    }

    pub async fn send(&self, notice: &Notice) -> Result<(), SendError> {
        let refused = |err: lettre::error::Error| SendError::refused(err.to_string());
        let message = self.message(notice).map_err(refused)?;
        let (envelope, text) = (message.envelope().clone(), message.formatted());
        let Err(err) = self.transport.send_raw(&envelope, &text).await else { return Ok(()) };
        let code = err.status().map(|code| code.to_string()).unwrap_or_default();
        // RFC 5321, section 4.2.3: this mailbox is not available, not local, or has no such name.
        let is_of_one = ["550", "551", "553"].contains(&code.as_str());
        if !is_of_one || self.to.len() == 1 {
            return Err(self.error(&err, &code));
        }
        // One of them is refused, and with it the message to all: the others get theirs alone.
        let mut failures = Vec::new();
        for one in &self.to {
            let alone = Envelope::new(Some(self.from.email.clone()), vec![one.email.clone()]);
            if let Err(err) = self.transport.send_raw(&alone.map_err(refused)?, &text).await {
                failures.push(format!("{}: {}", one.email, with_causes(&err)));
            }
        }
        match failures.is_empty() {
            true => Ok(()),
            // Not tried again: who has it would get it twice.
            false => Err(SendError::refused(failures.join("; "))),
        }
    }

    fn error(&self, err: &lettre::transport::smtp::Error, code: &str) -> SendError {
        // RFC 4954, section 6: authentication needed, too weak or refused.
        let hint = match (["530", "534", "535", "538"].contains(&code), self.is_login) {
            (true, true) => "; check user and password",
            (true, false) => "; add user and password_file",
            (false, _) => "",
        };
        let reason = format!("{}{hint}", with_causes(err));
        match err.is_permanent() {
            true => SendError::refused(reason),
            false => SendError::passing(reason),
        }
    }

    fn message(&self, notice: &Notice) -> Result<Message, lettre::error::Error> {
        let to = self.to.iter().fold(Message::builder(), |message, one| message.to(one.clone()));
        to.from(self.from.clone())
            .subject(notice.subject())
            .date(notice.time.into())
            .header(ContentType::TEXT_PLAIN)
            .body(notice.page())
    }
}

/// Certificates of a file alone, or those that the computer trusts.
fn parameters(server: &str, ca_file: Option<&[u8]>) -> Result<TlsParameters, SendError> {
    let failed = |err: lettre::transport::smtp::Error| SendError::passing(with_causes(&err));
    let mut builder = TlsParameters::builder(server.to_owned());
    if let Some(pem) = ca_file {
        tls::authorities(pem).map_err(SendError::passing)?;
        builder = builder
            .certificate_store(CertificateStore::None)
            .add_root_certificate(Certificate::from_pem(pem).map_err(failed)?);
    }
    builder.build().map_err(failed)
}
