# The service alone, on simulated devices or those that are handed in: docs/connecting.md has the line.
FROM python:3.13-slim@sha256:7c61056e61ac89e852de05f3dc6fa51a6dd2181797bceed46aa725dd7cb2cd3b AS needed
COPY hashes.txt /tmp/hashes.txt
RUN pip install --no-cache-dir --require-hashes -r /tmp/hashes.txt && rm /tmp/hashes.txt

FROM needed AS build
WORKDIR /source
COPY pyproject.toml hatch_build.py README.md LICENSE ./
COPY service/hapticvlm service/hapticvlm
COPY service/hapticvlm_studio service/hapticvlm_studio
COPY service/hapticvlm_recogniser_app service/hapticvlm_recogniser_app
RUN pip wheel --no-cache-dir --no-deps --no-build-isolation --wheel-dir /wheel .

FROM needed
ARG EXTRAS=
COPY constraints.txt /tmp/constraints.txt
COPY --from=build /wheel /tmp/wheel
RUN pip install --no-cache-dir --no-deps /tmp/wheel/*.whl \
    && pip install --no-cache-dir --constraint /tmp/constraints.txt "hapticvlm[$EXTRAS]" \
    && rm -r /tmp/wheel /tmp/constraints.txt \
    && useradd --create-home hapticvlm
USER hapticvlm
EXPOSE 8790
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
    CMD ["python", "-m", "hapticvlm.commands.alive"]
ENTRYPOINT ["hapticvlm"]
CMD ["serve", "--host", "0.0.0.0", "--pages-from", "lan", "--no-realtime"]
