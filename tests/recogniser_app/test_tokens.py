"""The tokens of a shared recogniser: one for all, one each, and a damaged file."""

import pytest

from hapticvlm.errors import UsageError
from hapticvlm_recogniser_app import tokens
from hapticvlm_recogniser_app.settings import TOKEN, TOKENS

LAB, ARCADE = "the-lab-has-this-one", "the-arcade-has-this"


def test_only_the_token_lets_in():
    one = tokens.Tokens({TOKEN: "correct horse"})
    assert one.client("Bearer correct horse") == tokens.ONLY
    for header in (None, "", "Bearer", "Bearer ", "Bearer wrong", "Basic correct horse"):
        assert one.client(header) is None
    assert tokens.Tokens({}).client(None) == tokens.ONLY
    with pytest.raises(UsageError, match=f"set {TOKEN} or {TOKENS}, not both"):
        tokens.Tokens({TOKEN: "correct horse", TOKENS: "clients.toml"})


def test_the_token_of_one_client_is_withdrawn_alone_and_a_damaged_file_changes_nothing(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(tokens, "LOOK_S", 0.0)
    file = tmp_path / "tokens"
    file.write_text(f"# ours\nlab {LAB}\narcade\t{ARCADE}\n")
    many = tokens.Tokens({TOKENS: str(file)})
    assert [many.client(f"Bearer {one}") for one in (LAB, ARCADE)] == ["lab", "arcade"]
    file.write_text(f"lab {LAB}\n", encoding="utf-8-sig")
    assert [many.client(f"Bearer {one}") for one in (LAB, ARCADE)] == ["lab", None]
    file.write_text("lab short\n")
    assert many.client(f"Bearer {LAB}") == "lab"


@pytest.mark.parametrize(
    "text", ["lab short\n", f"lab {LAB} more\n", f"lab {LAB}\nlab {ARCADE}\n", f"a {LAB}\nb {LAB}"]
)
def test_a_file_that_is_wrong_is_refused_by_its_line(tmp_path, text):
    file = tmp_path / "tokens"
    file.write_text(text)
    with pytest.raises(UsageError, match="tokens, line"):
        tokens.Tokens({TOKENS: str(file)})
