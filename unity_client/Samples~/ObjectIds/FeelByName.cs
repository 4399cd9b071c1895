using HapticVLM.Wire;
using UnityEngine;

namespace HapticVLM.Samples
{
    /// <summary>
    /// Four cubes whose material is decided by name alone. Add this to an empty object, press Play, and
    /// move a hand with a HapticHand into them. No camera is used and no frame is sent.
    /// </summary>
    public sealed class FeelByName : MonoBehaviour
    {
        static readonly string[] Names = { "OakTable", "WindowGlass", "WoolCurtain", "SteelKettle" };

        void Start()
        {
            if (HapticClient.Active == null) gameObject.AddComponent<HapticClient>();
            for (int i = 0; i < Names.Length; i++) Make(Names[i], new Vector3(0.4f * i - 0.6f, 1f, 0.5f));
        }

        static void Make(string name, Vector3 at)
        {
            GameObject cube = GameObject.CreatePrimitive(PrimitiveType.Cube);
            cube.name = name;
            cube.transform.position = at;
            cube.transform.localScale = new Vector3(0.25f, 0.25f, 0.25f);
            cube.AddComponent<HapticObject>().Decided += Report;
        }

        static void Report(Decision decision)
        {
            HapticObject felt = HapticObject.ById(decision.ObjectId);
            Debug.Log(felt.name + " feels like " + decision.Material + ", by " + decision.Source, felt);
        }
    }
}
