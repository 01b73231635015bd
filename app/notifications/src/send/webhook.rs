//! The object by HTTP POST.

use super::{SendError, with_causes};
use crate::notice::Notice;
use crate::secret::Secret;
use crate::settings::is_loopback;
use crate::target::WebhookTarget;
use crate::tls;
use reqwest::header::CONTENT_TYPE;
use reqwest::redirect::Policy;
use reqwest::{Client, StatusCode};
use url::Url;

pub(crate) struct WebhookSender {
    client: Client,
    url: Url,
    token: Option<Secret>,
}

impl WebhookSender {
    pub fn new(target: &WebhookTarget, ca_file: Option<&[u8]>) -> Result<Self, SendError> {
        let config = match target.url.scheme() {
            "https" => tls::client_config(ca_file).map(|config| (*config).clone()),
            _ => tls::no_encryption(),
        };
        let mut builder = Client::builder();
        if target.url.host_str().is_some_and(is_loopback) {
            // No proxy of the network reaches this computer itself.
            builder = builder.no_proxy();
        }
        let client = builder
            .tls_backend_preconfigured(config.map_err(SendError::passing)?)
            // A token goes to the server that the settings name and to no other.
            .redirect(Policy::none())
            // A server that closes what it seems to keep open costs an attempt; a notice an hour needs no open connection.
            .pool_max_idle_per_host(0)
            .user_agent(concat!("palpate/", env!("CARGO_PKG_VERSION")))
            .build()
            .map_err(|err| SendError::passing(with_causes(&err)))?;
        Ok(Self { client, url: target.url.clone(), token: target.token.clone() })
    }

    pub async fn send(&self, notice: &Notice) -> Result<(), SendError> {
        let mut request = self.client.post(self.url.clone());
        if let Some(token) = &self.token {
            request = request.bearer_auth(token.reveal());
        }
        let answer = request
            .header(CONTENT_TYPE, "application/json")
            .body(notice.json())
            .send()
            .await
            // The address of a chat's webhook is a secret.
            .map_err(|err| SendError::passing(with_causes(&err.without_url())))?;
        judge(answer.status())
    }
}

/// RFC 9110, section 15: what succeeded, what may succeed later, and what will not.
fn judge(status: StatusCode) -> Result<(), SendError> {
    let is_passing = status.is_server_error()
        || [StatusCode::REQUEST_TIMEOUT, StatusCode::TOO_EARLY, StatusCode::TOO_MANY_REQUESTS]
            .contains(&status);
    match status {
        status if status.is_success() => Ok(()),
        status if is_passing => Err(SendError::passing(format!("the server answered {status}"))),
        status if status.is_redirection() => Err(SendError::refused(format!(
            "the server answered {status}, which leads to another address; write that as url"
        ))),
        StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN => Err(SendError::refused(format!(
            "the server answered {status}; check the token and the address"
        ))),
        status => {
            Err(SendError::refused(format!("the server answered {status}; check the address")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_final_where_another_attempt_is_in_vain() {
        for (code, expected) in [
            (200, None),
            (204, None),
            (302, Some(true)),
            (400, Some(true)),
            (401, Some(true)),
            (404, Some(true)),
            (408, Some(false)),
            (429, Some(false)),
            (500, Some(false)),
            (503, Some(false)),
        ] {
            let judged = judge(StatusCode::from_u16(code).unwrap());
            assert_eq!(judged.err().map(|err| err.is_final), expected, "{code}");
        }
    }
}
