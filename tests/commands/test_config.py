"""Options from flags, a file and the environment: one declaration, three ways to state it."""

import argparse
import logging
from pathlib import Path
from typing import Any

import pytest
from each_case import each, each_row
from word_tables import words

from hapticvlm.client.local_service import running
from hapticvlm.commands import config_file, serve
from hapticvlm.errors import UsageError
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE
from hapticvlm.server.options import Option
from hapticvlm.server.settings import GROUPS, OPTIONS, ServeOptions

EXAMPLE = Path(__file__).parents[2] / "examples" / "hapticvlm.toml"
SECRET = "a-secret-nobody-prints"


def settled(*flags: str, **environment: str) -> ServeOptions:
    parser = argparse.ArgumentParser()
    serve.add_flags(parser)
    return serve.resolve_options(parser.parse_args(flags), environment)


def file(folder: Path, text: str) -> Path:
    path = folder / "hapticvlm.toml"
    path.write_text(text, encoding="utf-8")
    return path


def unlike_default(option: Option, folder: Path) -> Any:
    """Some value of the option's own that it does not have by itself."""
    if option.kind is bool:
        return True
    if option.details.range is not None:
        low, high = option.details.range
        return option.kind(high if option.default != high else low)
    if option.choices:
        return next(word for word in option.choices if word != option.default)
    if option.kind is Path:
        return folder / option.name
    return ["https://a.example", "https://b.example"] if option.kind is not str else "another"


def in_toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(str(value)) if isinstance(value, Path) else repr(value)


def as_flags(option: Option, value: Any) -> list[str]:
    if value is True:
        return [option.flag]
    given = value if isinstance(value, list) else [value]
    return [text for one in given for text in (option.flag, str(one))]


@each(option=OPTIONS, table=[True, False])
def test_every_option_means_the_same_as_a_flag_and_in_a_file(option, table, tmp_path):
    value = unlike_default(option, tmp_path)
    head = f"[{option.details.group}]\n" if table else ""
    path = file(tmp_path, f"{head}{option.name} = {in_toml(value)}\n")
    path.chmod(0o600)
    by_file = settled("--config", str(path))
    assert by_file == settled(*as_flags(option, value))
    assert getattr(by_file, option.field) != option.default


def test_nothing_stated_is_every_default(tmp_path):
    assert settled() == ServeOptions() == settled("--config", str(file(tmp_path, "")))


def test_every_option_is_in_a_group_that_has_a_title():
    assert {option.details.group for option in OPTIONS} == set(GROUPS)


def test_a_flag_wins_over_the_file_and_the_file_over_the_default(tmp_path):
    path = file(tmp_path, 'port = 9000\nlevel = 0.5\nallow-origin = ["https://a.example"]\n')
    found = settled("--config", str(path), "--port", "8790", "--allow-origin", "https://b.example")
    assert (found.port, found.level) == (8790, 0.5)
    assert found.allow_origin == ("https://b.example",)
    assert found.block == ServeOptions().block


def test_a_file_that_an_editor_on_windows_saved_with_its_mark_is_read(tmp_path):
    path = tmp_path / "windows.toml"
    path.write_text("port = 9000\r\n", encoding="utf-8-sig")
    assert settled("--config", str(path)).port == 9000


def test_the_secret_may_come_from_the_environment_between_file_and_flag(tmp_path):
    path = file(tmp_path, 'token = "of the file"\n')
    path.chmod(0o600)
    config = ("--config", str(path))
    assert settled(*config, HAPTICVLM_TOKEN="of the shell").token == "of the shell"
    assert settled(*config, "--token", "flag", HAPTICVLM_TOKEN="of the shell").token == "flag"
    assert settled(*config, HAPTICVLM_TOKEN="").token == "of the file"


def test_paths_in_a_file_are_relative_to_it_and_names_stay_names(tmp_path):
    (tmp_path / "own-encoder").mkdir()
    path = file(
        tmp_path,
        'wav = "a/b.wav"\nencoder = "own-encoder"\nvlm = "someone/model"\npeltier = "COM3"\n',
    )
    found = settled("--config", str(path))
    assert found.wav == tmp_path / "a" / "b.wav"
    assert found.encoder == str(tmp_path / "own-encoder")
    assert (found.vlm, found.peltier) == ("someone/model", "COM3")


def test_a_palm_may_be_stated_as_its_file_beside_the_config_file(tmp_path):
    palm = tmp_path / "palm.json"
    path = file(tmp_path, 'plate-resistance = "palm.json"\n')
    palm.write_text('{"calibrate": "plate", "plate_resistance": 2e-3}')
    assert settled("--config", str(path)).plate_resistance == 2e-3
    palm.write_text('{"calibrate": "plate", "plate_resistance": 0.5}')
    with pytest.raises(ValueError, match=r"plate-resistance: .*palm\.json has 0\.5"):
        settled("--config", str(path))
    palm.unlink()
    with pytest.raises(ValueError, match=r"hapticvlm\.toml: .*palm\.json"):
        settled("--config", str(path))


@pytest.mark.parametrize(("said", "meant"), [("true", ""), ("false", None), ('"x/y"', "x/y")])
def test_a_flag_that_may_stand_alone_is_true_in_a_file(said, meant, tmp_path):
    assert settled("--config", str(file(tmp_path, f"vlm = {said}\n"))).vlm == meant


@each_row(("text", "complaint"), words(Path(__file__).with_name("wrong_config.csv"), "wrong"))
def test_a_file_that_is_wrong_is_refused_naming_file_field_and_cure(text, complaint, tmp_path):
    path = file(tmp_path, text)
    with pytest.raises(ValueError, match=r"hapticvlm\.toml: ") as refused:
        config_file.read(path)
    assert complaint in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    with pytest.raises(UsageError, match="No such file"):
        config_file.read(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes(b'host = "\xe9"')
    with pytest.raises(ValueError, match="UTF-8"):
        config_file.read(tmp_path / "latin.toml")


def test_flags_have_the_ranges_of_the_file():
    with pytest.raises(ValueError, match=r"--level 2: outside 0\.\.1"):
        settled("--level", "2")


def test_a_token_in_a_file_that_others_can_read_is_warned_of_but_not_shown(tmp_path, caplog):
    path = file(tmp_path, f'token = "{SECRET}"\n')
    path.chmod(0o644)
    with caplog.at_level(logging.WARNING):
        found = settled("--config", str(path))
    assert "chmod 600" in caplog.text
    assert SECRET not in caplog.text + repr(found)


def test_the_example_states_only_defaults_but_the_level_and_starts():
    assert settled("--config", str(EXAMPLE)) == ServeOptions(level=0.8)
    with running(["--config", str(EXAMPLE)]) as service:
        assert service.url
    assert "simulated" in "".join(service.printed)  # lines below the first may be late


def test_a_secret_is_not_printed_by_the_service(tmp_path):
    path = file(tmp_path, f'token = "{SECRET}"\n')
    path.chmod(0o600)
    with running(["--config", str(path)]) as service:
        assert service.url
    assert SECRET not in "".join(service.printed)


def test_the_palm_that_is_assumed_is_that_of_the_physics():
    assert ServeOptions().plate_resistance == PLATE_RESISTANCE
