namespace UnityEngine.SceneManagement
{
    public struct Scene
    {
        public static string File = "";

        public bool isLoaded { get { return true; } }
        public string path { get { return File; } }

        public GameObject[] GetRootGameObjects()
        {
            return GameObject.Scene.FindAll(thing => !thing.IsDead && thing.transform.parent == null && thing.hideFlags == HideFlags.None).ToArray();
        }
    }

    public enum LoadSceneMode { Single, Additive }

    public static class SceneManager
    {
        public static event UnityEngine.Events.UnityAction<Scene, LoadSceneMode> sceneLoaded;
        public static void Load() { if (sceneLoaded != null) sceneLoaded(default(Scene), LoadSceneMode.Single); }
        public static int sceneCount { get { return 1; } }
        public static Scene GetSceneAt(int index) { return default(Scene); }
        public static Scene GetActiveScene() { return default(Scene); }
    }
}
