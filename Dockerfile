# syntax=docker/dockerfile:1
# One image for the web, the worker and the migrations; docker-compose.yml shows how they fit.

# The pages' scripts and styles.
FROM node:20-bookworm-slim AS pages
WORKDIR /src
COPY package.json package-lock.json ./
RUN npm ci --no-audit --no-fund
COPY tsconfig.json vite.config.ts ./
COPY static/src static/src
RUN npm run build

# The wheel, and an environment with it and the locked versions of all it needs.
FROM python:3.11-slim-bookworm AS environment
RUN pip install --no-cache-dir uv
WORKDIR /src
COPY pyproject.toml requirements.lock hatch_build.py README.md LICENSE ./
COPY app app
COPY worker worker
COPY quaymark quaymark
COPY tools tools
COPY templates templates
COPY migrations migrations
COPY --from=pages /src/static/dist static/dist
# EXTRAS=[s3] adds the file store in a bucket.
ARG EXTRAS=""
RUN uv build --wheel --out-dir /wheels \
 && uv venv /opt/quaymark \
 && wheel=$(echo /wheels/*.whl) \
 && uv pip install --python /opt/quaymark/bin/python --no-cache --compile-bytecode \
      --constraints requirements.lock "quaymark${EXTRAS} @ file://${wheel}"

FROM python:3.11-slim-bookworm
RUN useradd --system --uid 10001 --home-dir /var/lib/quaymark --create-home quaymark
COPY --from=environment /opt/quaymark /opt/quaymark
ENV PATH=/opt/quaymark/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    QUAYMARK_ENVIRONMENT=production \
    QUAYMARK_DATA_DIR=/var/lib/quaymark \
    QUAYMARK_HOST=0.0.0.0
USER quaymark
WORKDIR /var/lib/quaymark
VOLUME /var/lib/quaymark
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=5s --start-period=20s \
  CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/healthz', timeout=4)"]
CMD ["quaymark", "serve"]
