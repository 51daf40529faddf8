"""Examples made from JSON schemas are values the schemas allow."""

from pydantic import BaseModel, Field

from app.openapi_examples import example_of


class _Leaf(BaseModel):
    number: int
    text: str = Field(examples=["quay"])
    kind: str | None = None


class _Tree(BaseModel):
    leaf: _Leaf
    leaves: list[_Leaf]
    pair: tuple[float, bool]
    next: "_Tree | None" = None


def test_an_example_fits_its_model() -> None:
    """References, lists, unions and recursion come out as input that the model takes."""
    schema = _Tree.model_json_schema(ref_template="#/components/schemas/{model}")
    document = {"components": {"schemas": schema["$defs"]}}
    example = example_of(document, schema)
    tree = _Tree.model_validate(example)
    assert tree.leaf.text == "quay"
    assert len(tree.leaves) == 1
