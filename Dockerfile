# The service alone, on simulated devices or those that are handed in: docs/reach.md has the line.
FROM python:3.13-slim AS build
WORKDIR /source
COPY pyproject.toml hatch_build.py README.md LICENSE ./
COPY service/hapticvlm service/hapticvlm
COPY service/hapticvlm_studio service/hapticvlm_studio
COPY service/hapticvlm_recogniser_app service/hapticvlm_recogniser_app
RUN pip install --no-cache-dir build==1.3.0 && python -m build --wheel --outdir /wheel

FROM python:3.13-slim
COPY constraints.txt /tmp/constraints.txt
COPY --from=build /wheel /tmp/wheel
RUN pip install --no-cache-dir --constraint /tmp/constraints.txt /tmp/wheel/*.whl \
    && rm -r /tmp/wheel /tmp/constraints.txt \
    && useradd --create-home hapticvlm
USER hapticvlm
EXPOSE 8790
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
    CMD ["python", "-m", "hapticvlm.commands.alive"]
ENTRYPOINT ["hapticvlm"]
CMD ["serve", "--host", "0.0.0.0", "--pages-from", "lan", "--no-realtime"]
