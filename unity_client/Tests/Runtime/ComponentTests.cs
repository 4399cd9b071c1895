using System.Collections;
using NUnit.Framework;
using UnityEngine;
using UnityEngine.TestTools;

namespace HapticVLM.Tests
{
    // Play mode tests without a service: nothing listens on their address.
    public class ComponentTests
    {
        const string UnusedAddress = "ws://127.0.0.1:9/";

        [UnityTest]
        public IEnumerator ObjectsGenerateDifferentIds()
        {
            var first = new GameObject("first").AddComponent<HapticObject>();
            var second = new GameObject("second").AddComponent<HapticObject>();
            yield return null;
            Assert.IsNotEmpty(first.ObjectId);
            Assert.AreNotEqual(first.ObjectId, second.ObjectId);
            Assert.AreSame(first, HapticObject.ById(first.ObjectId));
            Object.Destroy(first.gameObject);
            Object.Destroy(second.gameObject);
            yield return null;
            Assert.IsNull(HapticObject.ById(first.ObjectId));
        }

        [UnityTest]
        public IEnumerator AClientWithoutAServiceKeepsRetryingWithoutBlockingFrames()
        {
            var client = new GameObject("client").AddComponent<HapticClient>();
            client.Connect(UnusedAddress);
            Assert.AreSame(client, HapticClient.Active);
            for (int frame = 0; frame < 30; frame++) yield return null;
            Assert.AreNotEqual(LinkState.Ready, client.State);
            Assert.AreEqual(0, client.Connection.Openings);
            Object.Destroy(client.gameObject);
            yield return null;
            Assert.IsNull(HapticClient.Active);
        }

        [UnityTest]
        public IEnumerator AStreamerWithoutAClientDoesNothing()
        {
            var streamer = new GameObject("streamer").AddComponent<FrameStreamer>();
            streamer.Capture();
            for (int frame = 0; frame < 5; frame++) yield return null;
            Assert.AreEqual(0, streamer.Sent + streamer.Errors);
            Object.Destroy(streamer.gameObject);
            yield return null;
        }
    }
}
