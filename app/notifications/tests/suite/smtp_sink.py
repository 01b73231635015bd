"""A mail server on a free port of this computer that prints what it gets: the port first, then a JSON object a line.

Usage: smtp_sink.py none|starttls|tls CERTIFICATE KEY [USER PASSWORD]
"""
import asyncio
import email
import email.policy
import json
import ssl
import sys

from aiosmtpd.smtp import SMTP, AuthResult

security, certificate, key = sys.argv[1:4]
login = [one.encode() for one in sys.argv[4:6]]


def say(value):
    print(json.dumps(value), flush=True)


class Handler:
    async def handle_RCPT(self, server, session, envelope, address, options):
        if address.startswith("former"):
            return "550 no such mailbox"
        envelope.rcpt_tos.append(address)
        return "250 known"

    async def handle_DATA(self, server, session, envelope):
        message = email.message_from_bytes(envelope.content, policy=email.policy.default)
        say({
            "encrypted": session.ssl is not None or security == "tls",
            "authenticated": bool(session.authenticated),
            "from": envelope.mail_from,
            "to": envelope.rcpt_tos,
            "headers": sorted(message.keys()),
            "subject": message["Subject"],
            "text": message.get_content(),
        })
        return "250 taken"


def authenticate(server, session, envelope, mechanism, data):
    is_right = [data.login, data.password] == login
    if not is_right:
        say({"refused": mechanism})
    return AuthResult(success=is_right, handled=is_right)


def session():
    context = None
    if security == "starttls":
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(certificate, key)
    return SMTP(Handler(), tls_context=context, require_starttls=security == "starttls",
                auth_required=bool(login), auth_require_tls=security == "starttls",
                authenticator=authenticate if login else None)


async def main():
    context = None
    if security == "tls":
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(certificate, key)
    server = await asyncio.get_running_loop().create_server(session, "127.0.0.1", 0, ssl=context)
    say(server.sockets[0].getsockname()[1])
    # Whoever started this ends it by closing its input.
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    server.close()

asyncio.run(main())
