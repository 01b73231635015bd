//! An answer that says what is wrong in one sentence.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Problem {
    status: StatusCode,
    sentence: String,
}

impl Problem {
    pub const fn new(status: StatusCode, sentence: String) -> Self {
        Self { status, sentence }
    }

    pub fn wrong(sentence: impl ToString) -> Self {
        Self::new(StatusCode::BAD_REQUEST, sentence.to_string())
    }

    pub fn missing(sentence: impl ToString) -> Self {
        Self::new(StatusCode::NOT_FOUND, sentence.to_string())
    }

    /// Something is asked for that the state of the rig or of the queue does not allow.
    pub fn conflict(sentence: impl ToString) -> Self {
        Self::new(StatusCode::CONFLICT, sentence.to_string())
    }

    pub fn unavailable(sentence: impl ToString) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, sentence.to_string())
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        (self.status, Json(json!({ "error": self.sentence }))).into_response()
    }
}
