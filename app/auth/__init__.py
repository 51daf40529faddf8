"""Who is calling and what they may do: denied unless a route and a role both say yes."""
