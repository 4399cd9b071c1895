// Runs the menu entry, the inspectors and the scan in the stub editor, in edit mode.
using System;
using System.Collections.Generic;
using System.Reflection;
using System.Threading;
using HapticVLM;
using HapticVLM.Editor;
using UnityEditor;
using UnityEngine;

public static class EditMode
{
    public sealed class XROrigin : MonoBehaviour { }

    public sealed class OVRCameraRig : MonoBehaviour { }

    static void SetUp(string rig)
    {
        Application.isPlaying = false;
        GameObject camera = Child(null, "Main Camera");
        camera.tag = "MainCamera";
        camera.AddComponent<Camera>();
        if (rig.Length > 0) MakeRig(rig, camera);
        GameObject table = Box("Table"), loose = Box("Cup"), zone = Box("Zone");
        loose.AddComponent<Rigidbody>();
        GameObject handle = Box("Handle");
        handle.transform.SetParent(loose.transform, false);
        zone.GetComponent<Collider>().isTrigger = true;
        Invoke();
        Describe("first");
        Invoke();
        Describe("again");
        Components.Say("tagged " + Has(table) + Has(loose) + Has(handle) + Has(zone));
        Undo.PerformUndo();
        Describe("undone");
        Selection.gameObjects = new[] { table };
        Invoke();
        Components.Say("selection tagged " + Has(table) + Has(loose));
    }

    static void MakeRig(string type, GameObject camera)
    {
        GameObject root = Child(null, "Rig");
        if (type == "XROrigin") root.AddComponent<XROrigin>();
        else root.AddComponent<OVRCameraRig>();
        Physics.World.Add(root.AddComponent<CharacterController>());
        GameObject space = Child(root, type == "XROrigin" ? "Camera Offset" : "TrackingSpace");
        camera.transform.SetParent(space.transform, false);
        foreach (string side in new[] { "Left", "Right" }) Child(space, type == "XROrigin" ? side + " Controller" : side + "HandAnchor");
        Child(space, "Body").AddComponent<BoxCollider>();
    }

    // An XRI rig with poke points, and hands of XR Hands that are inactive until they are tracked.
    static void SetUpTrackedHands()
    {
        Application.isPlaying = false;
        GameObject camera = Child(null, "Main Camera");
        camera.AddComponent<Camera>();
        MakeRig("XROrigin", camera);
        GameObject space = GameObject.Scene.Find(thing => thing.name == "Camera Offset");
        foreach (string side in new[] { "Left", "Right" })
        {
            GameObject controller = GameObject.Scene.Find(thing => thing.name == side + " Controller");
            Child(Child(controller, "Poke Interactor"), "Poke Point");
            GameObject hand = Child(Child(space, side + " Hand"), "Visual");
            foreach (string joint in new[] { "Palm", "Wrist", "ThumbTip", "IndexTip", "MiddleTip", "RingTip", "LittleTip" }) Child(hand, side.Substring(0, 1) + "_" + joint);
            hand.SetActive(false);
        }
        UnityEditor.SceneManagement.PrefabStageUtility.Open = new UnityEditor.SceneManagement.PrefabStage();
        Invoke();
        Describe("in a prefab");
        UnityEditor.SceneManagement.PrefabStageUtility.Open = null;
        Selection.gameObjects = new[] { camera };
        GameObject table = Box("Table");
        Invoke();
        Components.Say("tagged by a selection without colliders " + Has(table));
        Describe("hands");
    }

    static GameObject Child(GameObject parent, string name)
    {
        var made = new GameObject(name);
        if (parent != null) made.transform.SetParent(parent.transform, false);
        return made;
    }

    static GameObject Box(string name)
    {
        GameObject box = GameObject.CreatePrimitive(PrimitiveType.Cube);
        box.name = name;
        return box;
    }

    static string Has(GameObject thing)
    {
        return thing.GetComponent<HapticObject>() != null ? "1" : "0";
    }

    // Finds the menu entry by its path, like a user.
    public static void Invoke(string path = "GameObject/HapticVLM/Set Up Scene")
    {
        foreach (Type type in typeof(HapticWindow).Assembly.GetTypes())
        {
            foreach (MethodInfo method in type.GetMethods(BindingFlags.Static | BindingFlags.NonPublic))
            {
                var item = (MenuItem)Attribute.GetCustomAttribute(method, typeof(MenuItem));
                if (item != null && item.Path == path) method.Invoke(null, null);
            }
        }
    }

    static void ProjectChecks()
    {
        Type checks = typeof(HapticWindow).Assembly.GetType("HapticVLM.Editor.ProjectChecks");
        foreach (string problem in (List<string>)checks.GetMethod("Problems").Invoke(null, null)) Components.Say(problem);
    }

    static void Describe(string when)
    {
        var said = new List<string>();
        foreach (GameObject thing in GameObject.Scene)
        {
            var hand = thing.GetComponent<HapticHand>();
            if (!thing.IsGone && hand != null) said.Add(hand.Side + "@" + thing.transform.parent.name + (hand.Problem == null ? "+" : "-") + (thing.GetComponent<ControllerHaptics>() != null ? "c" : ""));
        }
        said.Sort();
        int clients = GameObject.Scene.FindAll(thing => !thing.IsGone && thing.GetComponent<HapticClient>() != null).Count;
        int objects = GameObject.Scene.FindAll(thing => !thing.IsGone && thing.GetComponent<HapticObject>() != null).Count;
        Components.Say(when + ": clients " + clients + " objects " + objects + " hands " + string.Join(" ", said.ToArray()));
    }

    static void Inspectors()
    {
        Application.isPlaying = false;
        GameObject box = Box("Mug");
        var mug = box.AddComponent<HapticObject>();
        var ghost = Child(null, "Ghost").AddComponent<HapticObject>();
        var hand = Child(null, "Hand").AddComponent<HapticHand>();
        Show("HapticObjectInspector", ghost);
        Show("HapticHandInspector", hand);
        EditorGUILayout.Chosen = "metal";
        EditorGUILayout.ChosenFor = "Material";
        Show("HapticObjectInspector", mug);
        Components.Say("chosen " + mug.StatedMaterial);
        mug.State("unobtainium");
        Show("HapticObjectInspector", mug);
        foreach (string line in EditorGUILayout.Output) Components.Say(line);
        Several();
    }

    // Thirty chairs of several materials: viewing changes none, a choice changes all.
    static void Several()
    {
        var chairs = new UnityEngine.Object[30];
        for (int i = 0; i < chairs.Length; i++)
        {
            var chair = Box("Chair" + i).AddComponent<HapticObject>();
            if (i % 2 == 1) chair.State("metal");
            chairs[i] = chair;
        }
        var shown = (UnityEditor.Editor)Activator.CreateInstance(typeof(HapticWindow).Assembly.GetType("HapticVLM.Editor.HapticObjectInspector"));
        bool takesSeveral = Attribute.IsDefined(shown.GetType(), typeof(CanEditMultipleObjects));
        shown.targets = chairs;
        shown.OnInspectorGUI();
        int metal = Array.FindAll(chairs, chair => ((HapticObject)chair).StatedMaterial == "metal").Length;
        EditorGUILayout.Chosen = "wood";
        EditorGUILayout.ChosenFor = "Material";
        shown.OnInspectorGUI();
        int wood = Array.FindAll(chairs, chair => ((HapticObject)chair).StatedMaterial == "wood").Length;
        Components.Say("several " + takesSeveral + " looked at metal " + metal + " chosen wood " + wood);
    }

    // The window of a scene of 10,000 objects draws only the visible rows, and finds an added object.
    static void LargeScene()
    {
        Application.isPlaying = false;
        for (int i = 0; i < 10000; i++) Child(null, "Thing" + i).AddComponent<HapticObject>();
        var window = EditorWindow.GetWindow<HapticWindow>("HapticVLM");
        EditorParts.Call(window, "OnEnable");
        EditorParts.Call(window, "OnGUI");
        int rows = EditorGUILayout.Output.FindAll(line => line.Contains("not scanned")).Count;
        Components.Private(window, "listScroll", new Vector2(0f, 200000f));
        EditorGUILayout.Output.Clear();
        EditorParts.Call(window, "OnGUI");
        bool hasLast = EditorGUILayout.Output.Exists(line => line.StartsWith("Thing9999:"));
        Child(null, "Added").AddComponent<HapticObject>();
        EditorApplication.ChangeHierarchy();
        EditorParts.Call(window, "OnGUI");
        Components.Say("rows " + rows + " last " + hasLast + " " + EditorGUILayout.Output.Find(line => line.Contains("10001 Haptic Objects")));
        EditorParts.Call(window, "OnDisable");
    }

    static void Show(string inspector, MonoBehaviour target)
    {
        var shown = (UnityEditor.Editor)Activator.CreateInstance(typeof(HapticWindow).Assembly.GetType("HapticVLM.Editor." + inspector));
        shown.target = target;
        shown.OnInspectorGUI();
    }

    // A scan of two objects, one a copy of the other, and the messages that the scene sends afterwards.
    static void Scan(string url)
    {
        Application.isPlaying = false;
        HapticObject oak = Tagged("OakPlanks", "OakPlanks"), kettle = Tagged("SteelKettle", "SteelKettle"), stated = Tagged("Thing", "Thing");
        Components.Private(kettle, "objectId", oak.ObjectId);
        Components.Private(stated, "material", "glass");
        foreach (HapticObject part in new[] { oak, kettle, stated }) PrefabUtility.MakeInstance(part);
        var window = EditorWindow.GetWindow<HapticWindow>("HapticVLM");
        Components.Private(window, "url", url);
        EditorParts.Call(window, "OnEnable");
        GUILayout.Pressed = "Scan scene";
        EditorParts.Call(window, "OnGUI");
        double until = Clock.Now + 60.0;
        while (!EditorParts.Shows(window, "objects tagged") && Clock.Now < until)
        {
            Player.Tick();
            Thread.Sleep(3);
        }
        PrefabUtility.SaveAndReload();
        foreach (string line in EditorGUILayout.Output.FindAll(line => line.Contains("tagged") || line.Contains(", by "))) Components.Say(line);
        Components.Say("ids_differ " + (oak.ObjectId != kettle.ObjectId) + " stated " + oak.StatedMaterial + " " + kettle.StatedMaterial + " " + stated.StatedMaterial
            + " saved " + (EditorUtility.Dirty > 0 && UnityEditor.SceneManagement.EditorSceneManager.Marked > 0) + " exceptions " + Debug.Exceptions + " errors " + Debug.Errors);
        EditorGUILayout.Chosen = "fabric";
        EditorGUILayout.ChosenFor = "OakPlanks";
        EditorParts.Call(window, "OnGUI");
        PrefabUtility.SaveAndReload();
        Components.Say("after review " + oak.StatedMaterial);
        EditorParts.Call(window, "OnDisable");
        Components.Say("left textures " + RenderTexture.Live);
    }

    public static HapticObject Tagged(string name, string material)
    {
        GameObject box = Box(name);
        box.transform.position = new Vector3(0f, 0f, 2f);
        box.GetComponent<Renderer>().sharedMaterial = new Material { name = material };
        return box.AddComponent<HapticObject>();
    }
}
