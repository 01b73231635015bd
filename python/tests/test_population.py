"""A population and limits of agreement are those of the command line."""
import palpate
import pytest

STIFFNESS = {"pig 1": (70, 77), "pig 2": (110, 121), "pig 3": (85, 92)}


@pytest.fixture(scope="module")
def study(command, tmp_path_factory):
    """Three animals, two specimens of each, each pressed by two operators."""
    folder = tmp_path_factory.mktemp("population")
    run = ["run", "ramp-hold", "--speed", 3, "--depth", 6, "--hold", 1, "--time-scale", "max"]
    for animal, percents in STIFFNESS.items():
        for lobe, percent in enumerate(percents):
            for operator in ("Ada", "Bea"):
                name = f"{animal} lobe {lobe}"
                words = ["--stiffness", percent, "--seed", percent, "--specimen", name, "--operator", operator]
                about = ["--about", f"animal.name={animal}"]
                command(*run, *words, *about, "--out", folder / f"{name} {operator}", home=folder / "home")
    return folder


def same(found, expected):
    assert found.to_dict() == {key: expected[key] for key in found}
    assert set(expected) - set(found) <= {"command", "version"}


def test_a_population_is_that_of_the_command(command, study, tmp_path):
    options = {"family": "series-1", "parameters": ["mu1"], "effects": ["operator"]}
    found = palpate.population(study, influence=True, out=tmp_path / "results", **options)
    words = ["--family", "series-1", "--parameters", "mu1", "--effect", "operator"]
    same(found, command("population", study, *words, "--influence"))
    assert (tmp_path / "results" / "population.html").is_file()
    assert repr(found).startswith("series-1: 3 animals, 6 specimens, 12 sessions")
    with pytest.raises(palpate.PalpateError, match="there is no level 'liver'"):
        palpate.population([study], levels=["liver"])


def test_agreement_is_that_of_the_command(command, study):
    found = palpate.agreement(study, "operator", family="series-1", parameters=["mu1"])
    same(found, command("agreement", study, "--between", "operator", "--family", "series-1", "--parameters", "mu1"))
    assert found["values"] == ["Ada", "Bea"]
