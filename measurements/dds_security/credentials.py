"""Keys, certificates, governance and permissions of one run, by openssl alone.

A folder for each participant has the names that the programs expect. No key outlives its run.
"""

import pathlib
import shutil
import subprocess

DOMAIN = 77

# Kinds of protection by level: metadata, data, rtps.
LEVELS = {
    "plain": None,
    "auth": ("NONE", "NONE", "NONE"),
    "data": ("NONE", "ENCRYPT", "NONE"),
    "meta": ("ENCRYPT", "ENCRYPT", "NONE"),
    "sign": ("ENCRYPT", "ENCRYPT", "SIGN"),
    "encrypt": ("ENCRYPT", "ENCRYPT", "ENCRYPT"),
}

# Topics that a participant may publish and subscribe.
RIGHTS = {
    "plant": (["rt/odom"], ["rt/cmd_vel"]),
    "node": (["rt/cmd_vel"], ["rt/odom"]),
    "insider": ([], ["rt/odom"]),
    "monitor": ([], ["rt/cmd_vel", "rt/odom"]),
    "everything": (["*"], ["*"]),
}

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
DOMAINS = f"<domains><id>{DOMAIN}</id></domains>"


def governance(level, checks="true"):
    """`checks` is false in the file of an insider that asks its own library for no check of rights."""
    metadata, data, rtps = LEVELS[level]
    rule = (
        "<topic_expression>*</topic_expression>"
        "<enable_discovery_protection>true</enable_discovery_protection>"
        "<enable_liveliness_protection>true</enable_liveliness_protection>"
        f"<enable_read_access_control>{checks}</enable_read_access_control>"
        f"<enable_write_access_control>{checks}</enable_write_access_control>"
        f"<metadata_protection_kind>{metadata}</metadata_protection_kind>"
        f"<data_protection_kind>{data}</data_protection_kind>"
    )
    return (
        f"{HEAD}<dds><domain_access_rules><domain_rule>{DOMAINS}"
        "<allow_unauthenticated_participants>false</allow_unauthenticated_participants>"
        "<enable_join_access_control>true</enable_join_access_control>"
        "<discovery_protection_kind>ENCRYPT</discovery_protection_kind>"
        "<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>"
        f"<rtps_protection_kind>{rtps}</rtps_protection_kind>"
        f"<topic_access_rules><topic_rule>{rule}</topic_rule></topic_access_rules>"
        "</domain_rule></domain_access_rules></dds>\n"
    )


def permissions(name, rights):
    def criterion(kind, topics):
        listed = "".join(f"<topic>{topic}</topic>" for topic in topics)
        return f"<{kind}><topics>{listed}</topics></{kind}>" if topics else ""

    publish, subscribe = RIGHTS[rights]
    return (
        f'{HEAD}<dds><permissions><grant name="{name}"><subject_name>CN={name}</subject_name>'
        "<validity><not_before>2020-01-01T00:00:00</not_before><not_after>2049-01-01T00:00:00</not_after></validity>"
        f"<allow_rule>{DOMAINS}{criterion('publish', publish)}{criterion('subscribe', subscribe)}</allow_rule>"
        "<default>DENY</default></grant></permissions></dds>\n"
    )


def openssl(*words):
    done = subprocess.run(["openssl", *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"openssl {' '.join(map(str, words))}: {done.stderr}")


def new_key(path):
    openssl("genpkey", "-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256", "-out", path)


class Signer:
    """A key and its certificate in a folder, which sign documents."""

    def __init__(self, folder):
        self.key, self.certificate = folder / "key.pem", folder / "certificate.pem"

    def sign(self, text, path):
        """The text as a signed document of S/MIME."""
        draft = path.with_suffix(".xml")
        draft.write_text(text)
        openssl("smime", "-sign", "-text", "-in", draft, "-out", path, "-signer", self.certificate, "-inkey", self.key)


class Authority(Signer):
    """A certificate authority with its key in a folder of its own."""

    def __init__(self, folder, name):
        super().__init__(folder)
        folder.mkdir(parents=True)
        new_key(self.key)
        openssl("req", "-x509", "-new", "-key", self.key, "-subj", f"/CN={name}", "-days", 30, "-out", self.certificate)

    def certify(self, folder, name):
        """A new key and its certificate in `folder`."""
        new_key(folder / "key.pem")
        request = folder / "request.pem"
        openssl("req", "-new", "-key", folder / "key.pem", "-subj", f"/CN={name}", "-out", request)
        openssl("x509", "-req", "-in", request, "-CA", self.certificate, "-CAkey", self.key, "-CAcreateserial",
                "-days", 30, "-out", folder / "certificate.pem")


class Authorities:
    """The authority of identities, the authority of permissions, and the participants that they admit. `is_one`: one for both."""

    def __init__(self, root, level, is_one=False):
        self.root, self.level = pathlib.Path(root), level
        self.identity = Authority(self.root / "identity", "identity authority")
        self.permissions = self.identity if is_one else Authority(self.root / "permissions", "permissions authority")

    def admit(self, name, rights, permissions_of=None):
        """A folder for the participant. `permissions_of`: another authority, which signs its governance and permissions."""
        signer = (permissions_of or self).permissions
        folder = self.root / "participants" / name
        folder.mkdir(parents=True)
        self.identity.certify(folder, name)
        shutil.copy(self.identity.certificate, folder / "identity_ca.pem")
        shutil.copy(signer.certificate, folder / "permissions_ca.pem")
        signer.sign(governance(self.level), folder / "governance.smime")
        signer.sign(permissions(name, rights), folder / "permissions.smime")
        return folder

    def admit_with_own_governance(self, name, rights, own):
        """Permissions as they were granted, beside a governance file of the participant's own without checks, which it signed itself."""
        folder = self.admit(name, rights)
        own.permissions.sign(governance(self.level, checks="false"), folder / "governance.smime")
        self.trust_also(folder, own.permissions)
        return folder

    def trust_also(self, folder, other):
        """The participant's own library accepts documents of a second authority; no other participant's does."""
        both = self.permissions.certificate.read_text() + other.certificate.read_text()
        (folder / "permissions_ca.pem").write_text(both)

    def admit_with_own_signature(self, name, rights):
        """Permissions that the participant granted itself and signed with the key of its own identity."""
        folder = self.admit(name, "insider")
        Signer(folder).sign(permissions(name, rights), folder / "permissions.smime")
        self.trust_also(folder, self.identity)
        return folder
