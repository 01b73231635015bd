//! Plain text by SMTP (RFC 5321).

use super::{ATTEMPT_MAX, SendError, with_causes};
use crate::notice::Notice;
use crate::target::{EmailTarget, Security};
use crate::tls;
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
        let message = self.message(notice).map_err(|err| SendError::refused(err.to_string()))?;
        match self.transport.send(message).await {
            Ok(_) => Ok(()),
            Err(err) => {
                let hint = match err.status().map(|code| code.to_string()) {
                    // RFC 4954, section 6: authentication needed, too weak or refused.
                    Some(code) if ["530", "534", "535", "538"].contains(&code.as_str()) => {
                        if self.is_login {
                            "; check user and password"
                        } else {
                            "; add user and password_file"
                        }
                    }
                    _ => "",
                };
                let reason = format!("{}{hint}", with_causes(&err));
                match err.is_permanent() {
                    true => Err(SendError::refused(reason)),
                    false => Err(SendError::passing(reason)),
                }
            }
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
