"""Words and texts for shaders."""
import numpy as np
import pytest
from conftest import golden

import nifkit
from nifkit import ErrorCode, ShaderLanguage


@pytest.fixture
def device():
    with nifkit.Device(shaders="on") as made:
        yield made


def proof_of(asset):
    """An object that shaders can answer."""
    return next(i for i, each in enumerate(asset.objects) if each.encoding is nifkit.Encoding.PROOF)


def float_at(words, index):
    return words[index : index + 1].view(np.float32)[0]


def test_words_of_an_object(device):
    with nifkit.load(golden("proof"), device=device) as asset:
        number = proof_of(asset)
        words = asset.shader_tables(number)
        assert words.dtype == np.uint32 and words.ndim == 1
        assert words[0] == 0x5346494E and words[2] == words.size
        about = asset.objects[number]
        assert np.array_equal(words[40:46].view(np.float32).reshape(2, 3), about.bounds)
        assert float_at(words, 46) == np.float32(about.bias)
        assert np.array_equal(words, asset.shader_tables(number))


def test_words_of_a_scene(device):
    with nifkit.load(golden("proof"), device=device) as asset, nifkit.Scene(device=device) as scene:
        for x in (0, 5):
            scene.add_instance(asset, proof_of(asset), [[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]])
        with pytest.raises(nifkit.Error) as raised:
            scene.shader_tables()
        assert raised.value.code == ErrorCode.INVALID_OPERATION
        scene.commit()
        words = scene.shader_tables()
        assert words[0] == 0x4346494E and words[2] == words.size and words[4] == 2
        assert float_at(words, 16 + 24 + 9) == 5  # the second instance's translation


def test_refusals(device):
    with nifkit.load(golden("spherical"), device=device) as asset:
        with pytest.raises(nifkit.Error) as raised:
            asset.shader_tables(0)
        assert raised.value.code == ErrorCode.NOT_AVAILABLE
        for wrong in (asset.object_count, -1, 2**32):
            with pytest.raises(nifkit.Error) as raised:
                asset.shader_tables(wrong)
            assert raised.value.code == ErrorCode.INVALID_ARGUMENT
        with pytest.raises(TypeError):
            asset.shader_tables("0")


def test_texts():
    assert "NifAnswer nif_query(" in nifkit.shader_source()
    assert nifkit.shader_source(ShaderLanguage.GLSL) == nifkit.shader_source()
    assert "fn nif_query(" in nifkit.shader_source(ShaderLanguage.WGSL)
    assert "StructuredBuffer<uint>" in nifkit.shader_source(ShaderLanguage.HLSL)
    assert "struct Nif {" in nifkit.shader_source(ShaderLanguage.METAL)
    with pytest.raises(nifkit.Error) as raised:
        nifkit.shader_source(7)
    assert raised.value.code == ErrorCode.INVALID_ARGUMENT
